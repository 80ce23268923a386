"""What to measure next: experiments that would separate what is still confused, by how much and how surely.

A swim at another speed or a dry run is simulated with either effect, as strong as the session has it, and with the
noise of the session; a free decay is two numbers more, a motor's log or a clock in view one more a trial. What is told
is the chance to still take one for the other afterwards, if one of the two is there: that of the likelier of two normal
hypotheses, at the odds that the session leaves and at the whitened distance d, refitted, that the new trial adds. What
these trials could tell of the two they have told: it is in the odds, and not in d. At even odds that is Phi(-d / 2).

Of more swims that is believed only as far as these swims bear it out. Two effects that they should tell apart by a
distance of a and do not, because forms of effects are rough and much else is amiss, will hardly be told apart by one
swim more: it counts by the share that the log odds of the two have of those expected, a^2 / 2, within one standard
deviation a (of a log likelihood ratio between two normal hypotheses).
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.special import expit
from scipy.stats import norm

from diagnosis.constants import MOST_ALIKE
from diagnosis.evidence import Hypotheses
from diagnosis.ground import Ground
from diagnosis.probabilities import Probabilities
from diagnosis.result import Experiment, ProposedTrial
from diagnosis.verdict import Verdict
from fitting.free_decay import Ring
from fitting.free_decay.ring import ring_changes, shows_in_decays
from fitting.model.noise import FeatureNoise
from fitting.model.session_model import SessionModel
from fitting.signatures import Signature, Whitened, signature_of
from fitting.signatures.session_row import with_trial
from fitting.signatures.signature import strengths as strengths_tried
from fitting.signatures.view_of import TO_PX, picture_px
from fitting.trial import MeasuredTrial, measure_trial
from session import CameraSpec, NotEnoughData, Tracks, TrialSpec
from session.errors import SimulationDiverged
from swimmer import Runs, Twin
from swimmer.effects import AffectedTwin, Effect

SPEEDS_HZ = (0.5, 0.8, 1.1, 1.4)
_DRY_HZ = 1.0
_NEW_HZ = 0.12  # that a speed must differ by from those that were swum
_SECONDS, _RUN_IN_BEATS, _START_M_S = 6.0, 4.0, 0.1
_LOGGED_TO, _CLOCKED_TO = 0.001, 0.001  # relative standard deviations of a motor's speed and of a clock in view
_LEAST = 1e-9  # probability, and distance, below which there is none
_DECAY = "Film a free decay: the head clamped in air, tendons off, the tail bent and let go"


class _Trial(NamedTuple):
    """A trial that could be made: what to do, and how it would be measured."""

    describe: str
    more: ProposedTrial
    twin: Twin
    measured: MeasuredTrial


class _Confused(NamedTuple):
    """Two effects that a session does not tell apart.

    Attributes:
        names: of the two.
        log_odds: of the one against the other where one of the two is there.
        apart: whitened distance by which its trials should tell them apart.
    """

    names: tuple[str, str]
    log_odds: float
    apart: float

    def added(self, then: float) -> float:
        """The distance that a trial adds with which it is that far: squares of independent data add up."""
        return float(np.sqrt(max(then**2 - self.apart**2, 0.0)))

    def experiment(self, describe: str, added: float, trial: ProposedTrial | None) -> Experiment:
        """One that adds a distance."""
        return Experiment(describe, self.names, error_left(added, self.log_odds), trial)


def next_experiments(
    ground: Ground,
    hypotheses: Hypotheses,
    verdict: Verdict,
    probabilities: Probabilities,
    effects: Mapping[str, Effect],
    seed: int = 0,
) -> tuple[Experiment, ...]:
    """For every two effects that stay confused, the most telling first.

    Those of each group of the verdict; of a gap that is unexplained the likeliest three.
    """
    confused = [_likeliest(hypotheses, probabilities)] if verdict.name == "unexplained" else verdict.groups
    strengths = _strengths(hypotheses, {name for group in confused for name in group}, ground, effects)
    tried = [pair for group in confused for pair in combinations((name for name in group if name in strengths), 2)]
    odds = {pair: log_odds for pair in tried if (log_odds := _odds(probabilities, pair)) is not None}
    if not odds:
        return ()
    now = _Looks.of(ground, ground.model, strengths, effects)
    pairs = [_Confused(pair, log_odds, now.apart(ground.space, pair)) for pair, log_odds in odds.items()]
    found = [experiment for pair in pairs for experiment in _with_a_number_more(ground, pair, now)]
    for trial in _trials(ground, seed):
        with suppress(NotEnoughData, SimulationDiverged, np.linalg.LinAlgError, ValueError):  # nan where one diverged
            wider = ground.with_trial(trial.twin, trial.measured)
            own = _Looks.of(wider, SessionModel(wider.model.trials[-1:]), strengths, effects)
            then = now.with_trial(own, ground.model)
            for pair in pairs:
                more = pair.added(then.apart(wider.space, pair.names))
                if trial.more.kind == "swim":
                    more *= np.sqrt(borne_out(pair.apart, pair.log_odds))
                found.append(pair.experiment(trial.describe, more, trial.more))
    if not ground.model.rings:
        found += _with_a_decay(ground, pairs, now)
    return tuple(sorted(found, key=lambda experiment: experiment.expected_error))


def _odds(found: Probabilities, pair: tuple[str, str]) -> float | None:
    """Log odds of the one against the other where one of the two is there; None where both probably are."""
    one, other, both = found.either_or(*pair)
    if both > one + other:
        return None
    return float(np.log(max(one, _LEAST)) - np.log(max(other, _LEAST)))


def borne_out(apart: float, log_odds: float) -> float:
    """Share of what swims should have told of two effects that they have told.

    Args:
        apart: whitened distance by which they should be told apart.
        log_odds: of the one against the other, of either sign.
    """
    told, expected = abs(log_odds) + apart, apart**2 / 2
    return 1.0 if told >= expected else told / expected


@dataclass(frozen=True, eq=False)
class _Looks:
    """What effects do to the trials of a model.

    Attributes:
        signatures: by name.
        changes: (k,) by name, as strong as the session has them.
        strengths: (p,) by name, which that is.
    """

    signatures: Mapping[str, Signature]
    changes: Mapping[str, np.ndarray]
    strengths: Mapping[str, np.ndarray]

    @classmethod
    def of(
        cls, ground: Ground, model: SessionModel, strengths: Mapping[str, np.ndarray], effects: Mapping[str, Effect]
    ) -> "_Looks":
        """To a model's trials beside the twin of a ground."""
        signatures, changes = {}, {}
        for name, strength in strengths.items():
            tried = strengths_tried(effects[name].suited(ground.twin.robot, ground.trials[0].markers))
            both = signature_of(effects[name], model, ground.camera, ground.at, np.vstack([tried, strength]))
            changes[name] = both.rows[-1]
            signatures[name] = replace(both, values=tried, features=both.features[:-1], beside=both.beside[:-1])
        return cls(signatures, changes, strengths)

    def with_trial(self, more: "_Looks", model: SessionModel) -> "_Looks":
        """Those to a model's trials and to one trial more."""
        changes = {name: with_trial(row, more.changes[name], model) for name, row in self.changes.items()}
        signatures = {}
        for name, signature in self.signatures.items():
            rows = with_trial(signature.rows.T, more.signatures[name].rows.T, model).T
            features = signature.features.shape[1] + more.signatures[name].features.shape[1]
            signatures[name] = replace(signature, features=rows[:, :features], beside=rows[:, features:])
        return _Looks(signatures, changes, self.strengths)

    def with_ring(self, ring: Ring, twin: Twin) -> "_Looks":
        """Those to the same trials and to a free decay more."""
        changes, signatures = {}, {}
        for name, signature in self.signatures.items():
            values = np.vstack([signature.values, self.strengths[name]])
            told = ring_changes(ring, twin, (signature.effect,), values)
            signatures[name] = replace(signature, beside=np.hstack([signature.beside, told[:-1]]))
            changes[name] = np.append(self.changes[name], told[-1])
        return _Looks(signatures, changes, self.strengths)

    def apart(self, space: Whitened, pair: tuple[str, str]) -> float:
        """The lesser distance of the one from the other, refitted."""
        ways = ((self.changes[own], self.signatures[other]) for own, other in (pair, pair[::-1]))
        found = [space.together(change, [other]).distance for change, other in ways if np.isfinite(change).all()]
        return min(found, default=0.0)


def _likeliest(hypotheses: Hypotheses, probabilities: Probabilities) -> tuple[str, ...]:
    shows = [i for i, form in enumerate(hypotheses.best) if form is not None]
    order = sorted(shows, key=lambda i: -probabilities.marginal[i])
    return tuple(probabilities.names[i] for i in order[:MOST_ALIKE])


def _strengths(
    hypotheses: Hypotheses, names: set[str], ground: Ground, effects: Mapping[str, Effect]
) -> dict[str, np.ndarray]:
    """(p,) of each effect, where it alone comes nearest to what is left."""
    target, found = ground.space.freed(ground.left), {}
    for each, form in zip(hypotheses.effects, hypotheses.best, strict=True):
        if each.name in names and form is not None:
            suited = effects[each.name].suited(ground.twin.robot, ground.trials[0].markers)
            values = np.zeros(len(suited.parameters))
            values[list(form.parameters)] = form.nearest(target) * form.sd
            found[each.name] = values
    return found


def _with_a_number_more(ground: Ground, pair: _Confused, now: _Looks) -> list[Experiment]:
    """A clock in view tells how fast the camera's clock goes, a motor's log how fast the crank turned."""
    filmed, turned = zip(*(_hertz(ground, now.signatures[n].effect, now.strengths[n]) for n in pair.names), strict=True)
    ways: list[tuple[str, float, float, ProposedTrial | None]]
    apart, of_crank = (abs(one - other) for one, other in (np.subtract(filmed, turned), turned))
    ways = [("Put a running clock into the picture and film one more swim", apart, _CLOCKED_TO, None)]
    if not ground.model.logged:
        again = ProposedTrial("swim", float(ground.swims[0].commanded_hz or ground.swims[0].frequency.hz), logged=True)
        ways.append(("Log the motor in one more swim", of_crank, _LOGGED_TO, again))
    return [pair.experiment(describe, told / to, trial) for describe, told, to, trial in ways if told > 0]


def _with_a_decay(ground: Ground, pairs: Sequence[_Confused], now: _Looks) -> list[Experiment]:
    """A free decay, where an effect shows in one: air tells hinges and masses from all that water does."""
    told = [pair for pair in pairs if any(shows_in_decays(now.signatures[name].effect) for name in pair.names)]
    if not told:
        return []
    markers = tuple(ground.trials[0].markers[i] for i in ground.trials[0].tail)
    frame_s = float(np.median(np.diff(ground.trials[0].time_s)))
    with suppress(SimulationDiverged, np.linalg.LinAlgError, ValueError):
        ring = Ring.to_come("free decay", ground.twin.robot, markers, frame_s)
        space, then = ground.with_ring(ring).space, now.with_ring(ring, ground.twin)
        decay = ProposedTrial("free_decay")
        return [pair.experiment(_DECAY, pair.added(then.apart(space, pair.names)), decay) for pair in told]
    return []


def _hertz(ground: Ground, effect: Effect, strength: np.ndarray) -> tuple[float, float]:
    """By how much what is filmed, and the crank, beats faster than commanded, relative, in the mean of the swims."""
    twin = AffectedTwin(ground.twin, [effect])
    hertz = [trial.commanded_hz or trial.frequency.hz for trial in ground.swims]
    filmed, turned = (
        float(np.mean([led_to(hz, strength) / hz - 1 for hz in hertz])) for led_to in (twin.measured_hz, twin.turned_hz)
    )
    return filmed, turned


def _trials(ground: Ground, seed: int) -> list[_Trial]:
    """Swims at other speeds, and a dry run where there was none."""
    swum = np.array([trial.commanded_hz or trial.frequency.hz for trial in ground.swims])
    found = []
    for hz in (hz for hz in SPEEDS_HZ if np.abs(swum - hz).min() > _NEW_HZ):
        with suppress(NotEnoughData, SimulationDiverged):
            measured = _measured(ground, ground.twin, hz, "swim", seed)
            found.append(_Trial(f"Film a swim at {hz:.1f} Hz", ProposedTrial("swim", hz), ground.twin, measured))
    if ground.has_dry:
        return found
    dry = ground.clamped_twin
    with suppress(NotEnoughData, SimulationDiverged):
        measured = _measured(ground, dry, _DRY_HZ, "dry", seed)
        describe = f"Film a dry run at {_DRY_HZ:g} Hz, the head clamped in air"
        found.append(_Trial(describe, ProposedTrial("dry", _DRY_HZ), dry, measured))
    return found


def _measured(ground: Ground, twin: Twin, hz: float, kind: str, seed: int) -> MeasuredTrial:
    """The plain twin, settled, seen with noise like that of the session."""
    like = ground.trials[0]
    frame_s, run_in_s = float(np.median(np.diff(like.time_s))), _RUN_IN_BEATS / hz
    time_s = np.arange(0.0, run_in_s + _SECONDS, frame_s)
    velocity = np.array([[-_START_M_S * hz, 0.0, 0.0]])
    told = twin.simulate(Runs(ground.at[None], np.array([hz]), np.zeros(1), velocity), time_s)
    noise = FeatureNoise.typical([model.noise for model in ground.model.trials], time_s)
    noise_m = noise.drawn(time_s, np.random.default_rng([seed, 13]))
    middle_px = np.array(picture_px(ground.trials, ground.camera)) / 2
    position_px = (told.marker_m[0] - told.marker_m[0].mean(axis=(0, 1)) + noise_m) / like.metres_per_px
    position_px = position_px * TO_PX + middle_px
    tracks = Tracks(like.markers, time_s, position_px, np.ones(position_px.shape[:2]))
    spec = TrialSpec(f"{kind}_{hz:.2f}", "swim", commanded_hz=hz, role="fit")
    camera = CameraSpec(1 / frame_s, twin.robot.scale_length_m)
    later = tracks.since(int(np.searchsorted(time_s, run_in_s)))
    return measure_trial(spec, later, camera, twin.robot, like.warmup_s)


def error_left(distance: float, log_odds: float) -> float:
    """Chance to take one of two normal hypotheses so far apart for the other, choosing the likelier (0.5: a coin)."""
    chance = float(expit(log_odds))
    if distance < _LEAST:
        return min(chance, 1 - chance)
    shift = log_odds / distance
    return float(chance * norm.cdf(-distance / 2 - shift) + (1 - chance) * norm.cdf(-distance / 2 + shift))
