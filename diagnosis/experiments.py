"""Experimental design: experiments that would separate two effects that a session confuses.

`next_experiments` proposes them, with the error that each would leave. A swim trial at another speed or a dry run is
simulated with either effect, as strong as the session has it. Their difference, coefficients refitted, in standard
deviations of the disturbances of such a trial is the distance d that it adds. A free decay adds two numbers, a motor's
log or a clock in view one. The result (`error_residual`) is the probability that one effect is still taken for the
other, if one of the two is present: of choosing the likelier of two normal hypotheses at distance d, at the odds that
the session leaves (at even odds Phi(-d/2)).

For further swim trials the distance counts only as far as the existing trials bear it out (`odds_over_expected`): two
effects that these should separate by a distance a and do not will hardly be separated by one more. It counts by the
ratio of the log odds of the two to those expected, a^2 / 2, within one standard deviation a (of a log likelihood ratio
between two normal hypotheses).
"""

from collections.abc import Mapping
from contextlib import suppress
from functools import partial
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.special import expit
from scipy.stats import norm

from diagnosis.constants import MOST_ALIKE
from diagnosis.evidence import Hypotheses
from diagnosis.hypotheses import Probabilities
from diagnosis.linear_model import LinearModel
from diagnosis.result import Experiment, ProposedTrial
from diagnosis.verdict import Verdict
from fitting.affected_trials import imagined, picture_px
from fitting.noise import FeatureNoise
from fitting.ring import Ring, ring_changes, shows_in_decays
from fitting.session_model import SessionModel
from fitting.signatures import signature_of
from fitting.trial import MeasuredTrial
from swimcal.effects.affected_twin import AffectedTwin
from swimcal.effects.effect import Effect
from swimcal.errors import NotEnoughData, SimulationDiverged
from swimcal.twin import Twin

SPEEDS_HZ = (0.5, 0.8, 1.1, 1.4)  # frequencies of the swims that may be proposed
_DRY_HZ = 1.0  # frequency of the dry run that may be proposed
_NEW_HZ = 0.12  # least distance of a new frequency from those that were swum
_SECONDS = 6.0  # length of a simulated trial
_START_M_S = 0.1  # start speed of a simulated trial at 1 Hz
_TOLD_TO = 0.001  # relative standard deviation of a motor's speed by its log, and of a clock in view
_LEAST = 1e-9  # probability and distance below which they count as zero
_DECAY = "Film a free decay: the head clamped in air, tendons off, the tail bent and let go"


def next_experiments(
    linear: LinearModel,
    hypotheses: Hypotheses,
    verdict: Verdict,
    probabilities: Probabilities,
    effects: Mapping[str, Effect],
    seed: int = 0,
) -> tuple[Experiment, ...]:
    """Propose experiments for every two effects that stay confused, the most informative first.

    The pairs are those of each group of the verdict; if the gap is unexplained, those of the likeliest three effects.

    Args:
        linear: the linearised model of the session.
        hypotheses: its hypotheses.
        verdict: its verdict.
        probabilities: probabilities of the effects.
        effects: the catalogue, by name.
        seed: seed of the noise of simulated trials.
    """
    confused = [_likeliest(hypotheses, probabilities)] if verdict.name == "unexplained" else verdict.groups
    strengths = _strengths(hypotheses, {name for group in confused for name in group}, linear, effects)
    pairs = []
    for names in (both for group in confused for both in combinations((n for n in group if n in strengths), 2)):
        if (log_odds := _odds(probabilities, names)) is not None:
            one, other = names
            pairs.append(_Pair((effects[one], effects[other]), (strengths[one], strengths[other]), log_odds))
    if not pairs:
        return ()
    found = [experiment for pair in pairs for experiment in _with_a_number_more(linear, pair)]
    borne = [np.sqrt(odds_over_expected(pair.apart(linear), pair.log_odds)) for pair in pairs]
    for describe, proposed, twin in _menu(linear):
        with suppress(NotEnoughData, SimulationDiverged, np.linalg.LinAlgError, ValueError):  # nan where one diverged
            alone = linear.other_trials([_simulate(linear, twin, proposed, seed)], twin)
            for pair, share in zip(pairs, borne, strict=True):
                distance = pair.apart(alone) * (share if proposed.kind == "swim" else 1.0)
                found.append(pair.experiment(describe, distance, proposed))
    if not linear.model.rings:
        found += _with_a_decay(linear, pairs)
    return tuple(sorted(found, key=lambda experiment: experiment.expected_error))


def odds_over_expected(apart: float, log_odds: float) -> float:
    """Return the ratio of the log odds of two effects to those expected from their distance; 1 at most.

    Args:
        apart: whitened distance of the two in the trials.
        log_odds: log odds of the one against the other.
    """
    found, expected = abs(log_odds) + apart, apart**2 / 2
    return 1.0 if found >= expected else found / expected


def error_residual(distance: float, log_odds: float) -> float:
    """Return the probability of taking one of two normal hypotheses for the other when choosing the likelier.

    Args:
        distance: distance of the two, in standard deviations.
        log_odds: log prior odds of the one against the other.

    Returns:
        0.5 is a coin toss.
    """
    chance = float(expit(log_odds))
    if distance < _LEAST:
        return min(chance, 1 - chance)
    shift = log_odds / distance
    return float(chance * norm.cdf(-distance / 2 - shift) + (1 - chance) * norm.cdf(-distance / 2 + shift))


class _Pair(NamedTuple):
    """Two effects that a session confuses."""

    effects: tuple[Effect, Effect]
    strengths: tuple[np.ndarray, np.ndarray]  # (p,) strengths of each in the session
    log_odds: float  # log odds of the one against the other if one of the two is present

    def experiment(self, describe: str, distance: float, trial: ProposedTrial | None) -> Experiment:
        """Return an experiment that adds a distance between the two."""
        first, second = (effect.name for effect in self.effects)
        return Experiment(describe, (first, second), error_residual(distance, self.log_odds), trial)

    def apart(self, linear: LinearModel) -> float:
        """Return the distance between the two effects in the trials of a linear model, coefficients refitted."""
        one, other = (
            signature_of(effect, linear.model, linear.camera, linear.at, strength[None]).rows[0]
            for effect, strength in zip(self.effects, self.strengths, strict=True)
        )
        return linear.space.length(one - other)


def _odds(found: Probabilities, pair: tuple[str, str]) -> float | None:
    """Return the log odds of one effect against the other if one of the two is present; None if both probably are."""
    one, other, both = found.either_or(*pair)
    if both > one + other:
        return None
    return float(np.log(max(one, _LEAST)) - np.log(max(other, _LEAST)))


def _likeliest(hypotheses: Hypotheses, probabilities: Probabilities) -> tuple[str, ...]:
    shows = [i for i, response in enumerate(hypotheses.best) if response is not None]
    order = sorted(shows, key=lambda i: -probabilities.marginal[i])
    return tuple(probabilities.names[i] for i in order[:MOST_ALIKE])


def _strengths(
    hypotheses: Hypotheses, names: set[str], linear: LinearModel, effects: Mapping[str, Effect]
) -> dict[str, np.ndarray]:
    """Return the strengths (p,) of each effect at which it alone comes nearest to the residual."""
    target, found = linear.space.projected(linear.residual), {}
    for each, response in zip(hypotheses.effects, hypotheses.best, strict=True):
        if each.name in names and response is not None:
            suited = effects[each.name].suited(linear.twin.robot, linear.trials[0].markers)
            values = np.zeros(len(suited.parameters))
            values[list(response.parameters)] = response.nearest(target) * response.sd
            found[each.name] = values
    return found


def _with_a_number_more(linear: LinearModel, pair: _Pair) -> list[Experiment]:
    """Propose a clock in view and a motor's log.

    The clock tells how fast the camera's clock goes, the log how fast the crank turned.
    """
    both = zip(pair.effects, pair.strengths, strict=True)
    filmed, turned = zip(*(_hertz(linear, *each) for each in both), strict=True)
    clock, crank = (abs(one - other) for one, other in (np.subtract(filmed, turned), turned))
    ways: list[tuple[str, float, ProposedTrial | None]]
    ways = [("Put a running clock into the picture and film one more swim", clock, None)]
    if not linear.model.logged:
        again = ProposedTrial("swim", float(linear.swims[0].commanded_hz or linear.swims[0].frequency.hz), logged=True)
        ways.append(("Log the motor in one more swim", crank, again))
    return [pair.experiment(describe, apart / _TOLD_TO, trial) for describe, apart, trial in ways if apart > 0]


def _hertz(linear: LinearModel, effect: Effect, strength: np.ndarray) -> tuple[float, float]:
    """Return how much faster than commanded the filmed beat and the crank are, relative, in the mean of the swims."""
    twin = AffectedTwin(linear.twin, [effect])
    hertz = [trial.commanded_hz or trial.frequency.hz for trial in linear.swims]
    filmed, turned = (
        float(np.mean([led_to(hz, strength) / hz - 1 for hz in hertz])) for led_to in (twin.measured_hz, twin.turned_hz)
    )
    return filmed, turned


def _with_a_decay(linear: LinearModel, pairs: list[_Pair]) -> list[Experiment]:
    """Propose a free decay, if an effect shows in one: air separates hinges and masses from all that water does."""
    shown = [pair for pair in pairs if any(map(shows_in_decays, pair.effects))]
    markers = tuple(linear.trials[0].markers[i] for i in linear.trials[0].tail)
    frame_s = float(np.median(np.diff(linear.trials[0].time_s)))
    with suppress(SimulationDiverged, np.linalg.LinAlgError, ValueError):
        ring = Ring.to_come("free decay", linear.twin.robot, markers, frame_s)
        doubted = SessionModel(linear.model.trials, (ring,)).ring_sensitivities if shown else np.zeros((2, 0))
        root = np.linalg.cholesky(np.diag(ring.sd**2) + doubted @ doubted.T)
        found = []
        for pair in shown:
            both = zip(pair.effects, pair.strengths, strict=True)
            one, other = (ring_changes(ring, linear.twin, (effect,), values[None])[0] for effect, values in both)
            distance = float(np.linalg.norm(np.linalg.solve(root, one - other)))
            found.append(pair.experiment(_DECAY, distance, ProposedTrial("free_decay")))
        return found
    return []


def _menu(linear: LinearModel) -> list[tuple[str, ProposedTrial, Twin]]:
    """List swims at other speeds, and a dry run where there was none, each with its twin."""
    swum = np.array([trial.commanded_hz or trial.frequency.hz for trial in linear.swims])
    new = [hz for hz in SPEEDS_HZ if np.abs(swum - hz).min() > _NEW_HZ]
    found = [(f"Film a swim at {hz:.1f} Hz", ProposedTrial("swim", hz), linear.twin) for hz in new]
    if len(linear.swims) < len(linear.trials):
        return found
    describe = f"Film a dry run at {_DRY_HZ:g} Hz, the head clamped in air"
    return [*found, (describe, ProposedTrial("dry", _DRY_HZ), linear.clamped_twin)]


def _simulate(linear: LinearModel, twin: Twin, proposed: ProposedTrial, seed: int) -> MeasuredTrial:
    """Simulate the plain twin, settled, and add noise like that of the session."""
    like, hz = linear.trials[0], proposed.commanded_hz
    assert hz is not None
    noise, random = FeatureNoise.typical([model.noise for model in linear.model.trials], like.time_s), [seed, 13]
    middle_px = np.array(picture_px(linear.trials, linear.camera)) / 2
    drawn = partial(noise.drawn, random=np.random.default_rng(random))
    return imagined(twin, like, linear.at, hz, _START_M_S * hz, _SECONDS, drawn, middle_px)
