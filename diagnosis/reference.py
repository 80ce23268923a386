"""Comparison with a reference session: how a healthy robot swims foretells how it would swim again.

Reference and changed session are of the same robot, camera and water, filmed at about the same commands. The trials of
both are jointly normal about the twin that was fitted to the reference. Effects act on the changed session alone; its
trials are conditional on those of the reference (Rasmussen and Williams 2006, equation A.6), so that what both sessions
have in common cancels: the error of the twin's water first of all. In the joint covariance:

- what both share: coefficients and robot as in any session, the span of the responses of all effects, `SHARED_SD` prior
  standard deviations wide, the camera's tilt, and an error of no particular cause that is smooth over frequency;
  trials at one command share a response, the mean of theirs;
- what differs from launch to launch: a little of every effect, trim, course, a tilted camera's scale, and how far the
  responses of trials at one command differ, as a twin is not quite smooth in its numbers;
- noise, boxes and the twin's own discrepancy, as in any session; at one command most of it comes again.

The sizes of the smooth error, of the discrepancy and of what differs between launches are those that the reference
makes likeliest. A few swims do not tell how wrong that covariance is of other launches at other commands: all that is
not foretold is wider by what the reference's swims miss of each other (`Comparison.leave_one_out_error`), or by more
still (`assumptions`). Nor do they tell whether the pool's water stands still: the twin's own error looks like a current
where few swims go few ways, and foretells wrong speeds of others. So both are weighed.

A strong change is not linear in its strength. `weigh_refits` therefore refits the few likeliest effects by simulation,
and weighs them by what they leave: normal noise, an unknown effect besides, and the effect's form error, a share of
each part of what it explains and the same share without structure:

    I + e^2 F F' + (e^2 |F|^2 + u^2) G,        F: the parts of the refitted response

with e and u averaged over their grids, and strengths by Laplace's approximation (MacKay 2003, chapter 28). At most one
effect changed: two that act together are `unexplained`, or the stronger one beside something else.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.special import logsumexp

from diagnosis.constants import (
    BETWEEN_LAUNCHES,
    CLEAR_CHANGE,
    ERROR_SIZES,
    LAUNCH_SIZES,
    SAME_COMMAND,
    SAME_COMMAND_ERROR_M,
    SAME_COMMAND_SHARE,
    SHARED_SD,
    SMOOTH_SIZES_M,
    TRIM,
    USUAL_BETWEEN_LAUNCHES,
    WIDER_IN_CHANGED,
)
from diagnosis.discrepancy import generic_covariance
from diagnosis.effect_response import EffectResponse
from diagnosis.evidence import Hypotheses, covariances_of_rest
from diagnosis.hypotheses import Assumed, Hypothesis, Probabilities
from diagnosis.linear_model import Given, LinearModel, SessionData, scatter_of_creeps, scatter_of_launch, slides_of_tilt
from diagnosis.refit import Refit
from diagnosis.result import ComparedWith, Visible
from fitting.affected_trials import with_picture
from fitting.covariance import LN_LENGTH, apart
from fitting.decay_fit import NUMBERS as RING_NUMBERS
from fitting.features import advance_phase
from fitting.session_model import NuisanceModel, SessionModel
from fitting.signatures import PRIOR_SD, Signature, little
from fitting.trial import MeasuredTrial
from swimcal.effects.effect import Effect
from swimcal.errors import NotEnoughData

_REFITTED = 4  # effects that are refitted, the likeliest
_HELD_SD = np.full(5, 1e-4)  # What is left to the coefficients is in the covariance already.


class Sizes(NamedTuple):
    """Sizes of what disturbs two sessions.

    Attributes:
        error: size of the twin's own discrepancy, against most sessions.
        smooth_m: size of the error of no particular cause that both sessions share, m.
        launch: size of what differs from launch to launch, but for the drive, against the usual; the trim differs by
            the usual at least.
        wider: factor on the standard deviation of all that the reference does not foretell of another session.
        moving: whether both sessions may share what moves a fish otherwise at each heading, as a current does.
    """

    error: float
    smooth_m: float
    launch: float
    wider: float = 1.0
    moving: bool = True


@dataclass(frozen=True, eq=False)
class Comparison:
    """Linearised model of two sessions at the twin that was fitted to the reference.

    Attributes:
        joint: all trials: swims of the reference, fitted and held-out ones of the changed session, then dry runs.
        groups: (t,) which session each trial belongs to: "reference", "changed" or "held_out".
        rings: which session each free decay belongs to: "reference" or "changed".
        signatures: what each effect does in all of them.
    """

    joint: LinearModel
    groups: tuple[str, ...]
    rings: tuple[str, ...]
    signatures: tuple[Signature, ...] = ()

    @classmethod
    def of(cls, data: SessionData) -> "Comparison":
        """Build the joint model of a session and its reference; dry runs count where both sessions have some.

        Raises:
            NotEnoughData: a session has no fitted swim.
            SimulationDiverged: the twin diverged at the coefficients of the reference.
        """
        reference = data.reference
        assert reference is not None, "a comparison needs a reference"
        swims = {
            "reference": reference.of_role(fitted=True),
            "changed": data.of_role(fitted=True),
            "held_out": data.of_role(fitted=False),
        }
        for name, session in (("reference", "the reference session"), ("changed", "the session")):
            if not swims[name]:
                raise NotEnoughData(f'no swim of role "fit" in {session}; a comparison needs at least one in each')
        both_dry = bool(reference.dry.runs) and bool(data.dry.runs)
        dry = {"reference": reference.dry.runs, "changed": data.dry.runs} if both_dry else {}
        decays = {"reference": reference.rings.believed, "changed": data.rings.believed}
        if not all(decays.values()):
            decays = {}
        every = [trial for part in (*swims.values(), *dry.values()) for trial in part]
        joint = LinearModel.of(
            [trial for part in swims.values() for trial in part],
            data.twin,
            with_picture(data.camera, every),
            data.discrepancy,
            reference.at,
            [trial for part in dry.values() for trial in part],
            [ring for part in decays.values() for ring in part],
        )
        groups = tuple(name for parts in (swims, dry) for name, part in parts.items() for _ in part)
        return cls(joint, groups, tuple(name for name, part in decays.items() for _ in part))

    def with_signatures(self, signatures: Sequence[Signature]) -> "Comparison":
        """Return the comparison that knows what each effect does in all trials."""
        return replace(self, signatures=tuple(signatures))

    @cached_property
    def of_changed(self) -> tuple[Signature, ...]:
        """Signatures of the effects in the fitted trials of the changed session."""
        places = self._places(self._numbers("changed"), "changed")
        features = places[places < len(self.joint.model.measured)]
        beside = places[len(features) :] - len(self.joint.model.measured)
        return tuple(
            Signature(each.effect, each.values, each.features[:, features], each.beside[:, beside])
            for each in self.signatures
        )

    @cached_property
    def sizes(self) -> Sizes:
        """The sizes that the reference makes likeliest, where both sessions may share a current."""
        return self._likeliest(moving=True)

    def _likeliest(self, *, moving: bool) -> Sizes:
        places = self._places(self._numbers("reference"), "reference")
        residual = self.joint.residual[places]
        found = {}
        for error, smooth_m, launch in product(ERROR_SIZES, SMOOTH_SIZES_M, LAUNCH_SIZES):
            sizes = Sizes(error, smooth_m, launch, moving=moving)
            known = cho_factor(self._covariance(sizes, places), lower=True)
            deviance = float(residual @ cho_solve(known, residual)) + 2 * float(np.log(np.diag(known[0])).sum())
            chance = ERROR_SIZES[error] * SMOOTH_SIZES_M[smooth_m] * LAUNCH_SIZES[launch]
            found[sizes] = np.log(chance) - deviance / 2
        likeliest = max(found, key=lambda each: found[each])
        return likeliest._replace(wider=max(1.0, self.leave_one_out_error(likeliest)))

    def leave_one_out_error(self, sizes: Sizes) -> float:
        """Return how far swims of the reference are from what the others foretell of them, in standard deviations.

        Each swim is left out in turn (Rasmussen and Williams 2006, section 5.4.2).

        Args:
            sizes: sizes of what disturbs the sessions.

        Returns:
            The root mean square over all numbers; 1 where there is a single swim.
        """
        every = self._numbers("reference")
        swims = [i for i in every if i < len(self.joint.swims)]
        if len(swims) < 2:
            return 1.0
        squares, count = 0.0, 0
        for number in swims:
            own = self._places([number])
            others = self._places([i for i in every if i != number], "reference")
            foretold, covariance = self._conditional(sizes, others, own)
            measured = np.flatnonzero(self.joint.observed[own])
            off = (self.joint.residual[own] - foretold)[measured]
            squares += float(off @ np.linalg.solve(covariance[np.ix_(measured, measured)], off))
            count += len(measured)
        return float(np.sqrt(squares / count))

    def assumptions(self) -> tuple[Assumed, ...]:
        """Return the model of the changed session for each width of what is not foretold, in still and moving water."""
        found = (self.sizes, self._likeliest(moving=False)) if self._moving else (self.sizes,)
        return tuple(
            Assumed(
                float(np.log(chance / len(found))), self.model_of("changed", each._replace(wider=wider * each.wider))
            )
            for each in found
            for wider, chance in WIDER_IN_CHANGED.items()
        )

    def model_of(self, group: str, sizes: Sizes, trials: Sequence[MeasuredTrial] | None = None) -> LinearModel:
        """Return the model of trials of the changed session, given the reference.

        Args:
            group: "changed" or "held_out".
            sizes: sizes of what disturbs the sessions.
            trials: some of these trials; default all.
        """
        numbers = self._numbers(group)
        if trials is not None:
            wanted = {trial.name for trial in trials}
            numbers = [i for i in numbers if self.joint.trials[i].name in wanted]
        own = self._places(numbers, group)
        foretold, covariance = self._conditional(sizes, self._places(self._numbers("reference"), "reference"), own)
        given = Given(
            foretold,
            sizes.wider**2 * covariance,
            _HELD_SD,
            lambda others: self.model_of("held_out", sizes, others),
        )
        joint, features = self.joint, own[own < len(self.joint.model.measured)]
        rings = tuple(ring for ring, whose in zip(joint.model.rings, self.rings, strict=True) if whose == group)
        model = SessionModel(tuple(joint.model.trials[i] for i in numbers), rings)
        disturbances = NuisanceModel(
            joint.disturbances.noise[np.ix_(features, features)],
            *(part[features] for part in joint.disturbances[1:]),
        )
        found = replace(joint, model=model, disturbances=disturbances, given=given, common=None)
        found.__dict__.update(residual=joint.residual[own] - foretold, slopes=joint.slopes[own])
        return found

    def _conditional(self, sizes: Sizes, known: np.ndarray, own: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return mean (k,) and covariance (k, k) of some numbers of the joint row, given others (equation A.6)."""
        whole, count = self._covariance(sizes, np.concatenate([known, own])), len(known)
        factor, across = cho_factor(whole[:count, :count], lower=True), whole[:count, count:]
        covariance = whole[count:, count:] - across.T @ cho_solve(factor, across)
        return across.T @ cho_solve(factor, self.joint.residual[known]), (covariance + covariance.T) / 2

    def compared_with(self, hypotheses: Hypotheses) -> ComparedWith:
        """Return what the comparison rests on, and which changes it would show.

        Args:
            hypotheses: hypotheses of the changed session, with the responses to each effect.
        """
        swims = [self.joint.trials[i] for i in self._numbers("reference")]
        return ComparedWith(
            session="",
            swims=tuple(trial.name for trial in swims),
            launch_scatter=self.sizes.launch,
            speeds={trial.name: (float(trial.frequency.hz), float(trial.speed)) for trial in swims},
            visible={
                signature.effect.name: seen
                for signature, each in zip(self.of_changed, hypotheses.effects, strict=True)
                if (seen := _visible(signature.effect, each)) is not None
            },
        )

    def _numbers(self, group: str) -> list[int]:
        return [i for i, whose in enumerate(self.groups) if whose == group]

    def _places(self, numbers: Sequence[int], group: str | None = None) -> np.ndarray:
        """Return the places in the joint row of what some trials measured, and the free decays of a session."""
        model = self.joint.model
        count, features = len(model.trials), len(model.measured)
        own = features // count
        parts = [np.arange(own * i, own * (i + 1)) for i in numbers]
        parts.append(features + np.array(numbers, int))
        logged = [place for place, i in enumerate(model.logged) if i in numbers]
        parts.append(features + count + np.array(logged, int))
        first = model.places_of_rings.start
        decays = [i for i, whose in enumerate(self.rings) if whose == group]
        each = model.of_creeps // count
        parts += [np.arange(each * i, each * (i + 1)) + model.places_of_creeps.start for i in numbers]
        parts += [np.arange(RING_NUMBERS * i, RING_NUMBERS * (i + 1)) + first for i in decays]
        return np.concatenate(parts)

    def _covariance(self, sizes: Sizes, places: np.ndarray) -> np.ndarray:
        """Return the covariance of some numbers of the joint row; what is not observed foretells nothing."""
        square = np.ix_(places, places)
        shared = self._shared(moving=sizes.moving)[places]
        every = (
            self._known[square]
            + sizes.error**2 * self._of_twin[square]
            + shared @ shared.T
            + self._rough[square]
            + sizes.smooth_m**2 * self._smooth[square]
            + SAME_COMMAND_ERROR_M**2 * self._of_command[square]
            + sizes.launch**2 * self._of_launch[square]
            + max(sizes.launch, 1.0) ** 2 * self._of_trim[square]
            + self._of_drive[square]
        )
        return apart(every, self.joint.observed[places])

    @cached_property
    def _known(self) -> np.ndarray:
        """Covariance (k, k) of noise and nuisances."""
        return replace(self.joint, error=0.0).covariance

    @cached_property
    def _of_twin(self) -> np.ndarray:
        """Covariance (k, k) of the twin's own discrepancy in most sessions; it comes again at the same command."""
        alike = SAME_COMMAND_SHARE * self._together
        np.fill_diagonal(alike, 1.0)
        return self._padded(self.joint.discrepancy.over(self.joint.model, alike))

    @cached_property
    def _slopes(self) -> Mapping[str, np.ndarray]:
        """Columns (k, p) of one prior standard deviation of each parameter, by effect."""
        found = {}
        for each in self.signatures:
            own = [(parameter.sd, little(each, i)) for i, parameter in enumerate(each.effect.parameters)]
            columns = [sd * slope for sd, slope in own if slope is not None]
            if columns:
                found[each.effect.name] = np.nan_to_num(np.column_stack(columns))
        return found

    @cached_property
    def _responses(self) -> Mapping[str, "_Response"]:
        """Responses that both sessions share, `SHARED_SD` wide, by the effect's name; "" are the coefficients."""
        every = {"": self.joint.slopes * PRIOR_SD}
        every |= {name: SHARED_SD * part for name, part in self._slopes.items()}
        by_way = {each.effect.name for each in self.signatures if each.effect.stage == "camera"} | set(self._moving)
        return {
            name: _Response.of(part, self.joint.model, () if name in by_way else self._at_one_command)
            for name, part in every.items()
        }

    @cached_property
    def _at_one_command(self) -> tuple[list[int], ...]:
        """Numbers of the trials at one command, of both sessions, for each command with several."""
        ln_hz, clamped, found = self._ln_hz, self._clamped, []
        for kind in (False, True):
            numbers = [int(i) for i in np.argsort(ln_hz, kind="stable") if clamped[i] == kind]
            ends = [0, *(np.flatnonzero(np.diff(ln_hz[numbers]) > SAME_COMMAND) + 1), len(numbers)]
            found += [numbers[first:last] for first, last in pairwise(ends)]
        return tuple(each for each in found if len(each) > 1)

    @property
    def _ln_hz(self) -> np.ndarray:
        """Logarithms (t,) of the frequencies of all trials, in Hz."""
        return np.log([each.trial.frequency.hz for each in self.joint.model.trials])

    @property
    def _clamped(self) -> np.ndarray:
        """Mask (t,) of the trials with the head clamped in air."""
        return np.array([each.twin.scene.head_clamped for each in self.joint.model.trials])

    @property
    def _moving(self) -> tuple[str, ...]:
        """Names of the effects that move the fish otherwise at each heading."""
        effects = [each.effect for each in self.signatures]
        return tuple(each.name for each in effects if each.stage != "camera" and "in_trial" in each.enters())

    def _shared(self, *, moving: bool) -> np.ndarray:
        """Return columns (k, c) of what both sessions share."""
        left_out = () if moving else self._moving
        effects = [each.shared for name, each in self._responses.items() if name not in left_out]
        return np.hstack([*effects, self._tilt])

    @cached_property
    def _tilt(self) -> np.ndarray:
        """Columns (k, 2) of one prior standard deviation of the camera's tilt about either axis of the picture."""
        features = slides_of_tilt(self.joint.model)
        return np.pad(features, [(0, len(self.joint.observed) - len(features)), (0, 0)])

    @cached_property
    def _rough(self) -> np.ndarray:
        """Covariance (k, k) of what the responses of single trials differ by from those at their command."""
        own = np.hstack([each.own for each in self._responses.values()]) / SHARED_SD
        return np.asarray((own @ own.T) * self._in_one_trial)

    @cached_property
    def _in_one_trial(self) -> np.ndarray:
        """Mask (k, k) of the numbers of the row that are of one trial."""
        trial_of = self.joint.trial_of
        return np.asarray(np.equal.outer(trial_of, trial_of) & (trial_of >= 0))

    @cached_property
    def _of_launch(self) -> np.ndarray:
        """Covariance (k, k) of what usually differs from launch to launch, but for drive and trim."""
        model, driving = self.joint.model, self._driving
        found = self._between_launches([name for name in self._slopes if name not in (*driving, TRIM)])
        found += self._padded(np.diag(scatter_of_launch(model) ** 2))
        creeps = model.places_of_creeps
        found[creeps, creeps] += scatter_of_creeps(model)
        return found

    @cached_property
    def _of_trim(self) -> np.ndarray:
        """Covariance (k, k) of the trim, which differs by the usual at least: in wakes by more than all else does."""
        return self._between_launches([name for name in self._slopes if name == TRIM])

    @cached_property
    def _of_drive(self) -> np.ndarray:
        """Covariance (k, k) of what usually differs in the drive: markers do not tell how well a motor keeps time."""
        return self._between_launches(self._driving)

    @property
    def _driving(self) -> list[str]:
        """Names of the effects on the drive that do anything in these trials."""
        names = [each.effect.name for each in self.signatures if each.effect.stage == "drive"]
        return [name for name in names if name in self._slopes]

    def _between_launches(self, names: Sequence[str]) -> np.ndarray:
        """Return the covariance (k, k) of what some effects make differ from launch to launch."""
        columns = [BETWEEN_LAUNCHES.get(name, USUAL_BETWEEN_LAUNCHES) * self._slopes[name] for name in names]
        every = np.hstack([np.zeros((len(self.joint.observed), 0)), *columns])
        return np.asarray((every @ every.T) * self._in_one_trial)

    @cached_property
    def _smooth(self) -> np.ndarray:
        """Covariance (k, k) of an error of one metre that is smooth over frequency, the same in both sessions."""
        near = np.exp(-0.5 * (np.subtract.outer(self._ln_hz, self._ln_hz) / LN_LENGTH) ** 2)
        return self._of_no_cause(near * np.equal.outer(self._clamped, self._clamped))

    @cached_property
    def _of_command(self) -> np.ndarray:
        """Covariance (k, k) of an error of one metre that each command with several trials has to itself."""
        return self._of_no_cause(self._together)

    @cached_property
    def _together(self) -> np.ndarray:
        """Mask (t, t), 1 where two trials are at one command; 0 on the diagonal, too, where a command has one trial."""
        found = np.zeros((len(self.joint.model.trials),) * 2)
        for numbers in self._at_one_command:
            found[np.ix_(numbers, numbers)] = 1.0
        return found

    def _of_no_cause(self, alike: np.ndarray) -> np.ndarray:
        """Return the covariance (k, k) of an error of one metre that trials have in common as told (t, t)."""
        model = self.joint.model
        count = len(model.trials)
        directions = np.linalg.cholesky(generic_covariance(model.trials[0].along_m, 1, 0)).T  # (g, g)
        turned = advance_phase(np.repeat(directions[:, None], count, axis=1), model.phase_rad)  # (q, t, g)
        columns = turned.reshape(len(turned), -1).T  # (t g, q)
        own = len(model.measured) // count
        return self._padded((columns @ columns.T) * np.kron(alike, np.ones((own, own))))

    def _padded(self, features: np.ndarray) -> np.ndarray:
        whole = np.zeros((len(self.joint.observed),) * 2)
        whole[: len(features), : len(features)] = features
        return whole


class _Response(NamedTuple):
    """Response of all trials to what both sessions share, split into what trials at one command have in common.

    Attributes:
        shared: (k, p) response, the same at one command.
        own: (k, p) what each trial's own differs by from it.
    """

    shared: np.ndarray
    own: np.ndarray

    @classmethod
    def of(cls, columns: np.ndarray, model: SessionModel, at_one_command: Sequence[list[int]]) -> "_Response":
        """Split columns (k, p); all is shared where no command has several trials."""
        count, features = len(model.trials), len(model.measured)
        each = columns[:features].reshape(count, -1, columns.shape[1]).transpose(2, 0, 1)  # (p, t, g)
        in_step = advance_phase(each, np.broadcast_to(-model.phase_rad, each.shape[:2]))
        off, mean = np.zeros_like(in_step), in_step.copy()
        for numbers in at_one_command:
            mean[:, numbers] = in_step[:, numbers].mean(axis=1, keepdims=True)
            off[:, numbers] = (in_step - mean)[:, numbers] * np.sqrt(len(numbers) / (len(numbers) - 1))
        turned = (advance_phase(part, np.broadcast_to(model.phase_rad, part.shape[:2])) for part in (mean, off))
        shared, own = columns.copy(), np.zeros_like(columns)
        shared[:features], own[:features] = (part.transpose(1, 2, 0).reshape(features, -1) for part in turned)
        return cls(shared, own)


def _visible(effect: Effect, response: EffectResponse) -> Visible | None:
    """Return the least change of the parameter that shows best; None for an effect that does nothing."""
    found = []
    for each in response.linear:
        if len(each.parameters) == 1 and (seen := float(np.linalg.norm(each.columns))) > 0:
            needed = CLEAR_CHANGE / seen
            found.append((needed, each.parameters[0], bool(needed <= max(-each.low[0], each.high[0]))))
    if not found:
        return None
    needed, number, inside = min(found)
    parameter = effect.parameters[number]
    return Visible(parameter.name, needed * parameter.sd, parameter.unit, inside)


# Weights after refits.


def candidates(hypotheses: Hypotheses) -> tuple[str, ...]:
    """Return the effects to refit: those that alone are likeliest, with or without an unknown one."""
    shows = [i for i, each in enumerate(hypotheses.effects) if each.linear]
    weight = {i: max(hypotheses.evidence((i,), other) for other in (False, True)) for i in shows}
    return tuple(hypotheses.effects[i].name for i in sorted(shows, key=lambda i: -weight[i])[:_REFITTED])


def weigh_refits(
    linear: LinearModel,
    hypotheses: Hypotheses,
    found: Probabilities,
    refitting: Callable[[Sequence[str]], Refit],
) -> tuple[Probabilities, Mapping[str, Refit]]:
    """Weigh single changes anew; how probable any change is stays.

    Args:
        linear: the linearised model of the changed session.
        hypotheses: its hypotheses.
        found: their probabilities by linear responses.
        refitting: refits the twin with named effects.

    Returns:
        The probabilities, and the refits by the effect's name.
    """
    refits = {name: refitting([name]) for name in candidates(hypotheses)}
    every, priors = len(hypotheses.effects), hypotheses.priors
    logs = {}
    for each in found.of:
        if each.present or each.other:
            names = [found.names[i] for i in each.present]
            evidence = (
                evidence_of(linear, hypotheses, refits[names[0]], each.other)
                if names and names[0] in refits
                else hypotheses.evidence(each.present, each.other)
            )
            logs[each] = evidence + priors.log_prior(len(each.present), each.other, every)
    odds = found.look_alike
    if odds is not None:
        logs = {key: log + float(np.log1p(odds[int(key.other), list(key.present)]).sum()) for key, log in logs.items()}
    total, rest = logsumexp(list(logs.values())), 1 - found.null
    chances = {key: rest * float(np.exp(log - total)) for key, log in logs.items()}
    return Probabilities(found.names, {Hypothesis(()): found.null} | chances, found.at_place, odds), refits


def evidence_of(linear: LinearModel, hypotheses: Hypotheses, fit: Refit, other: bool) -> float:
    """Return the log evidence of a refitted twin, comparable with `Hypotheses.evidence`.

    Args:
        linear: the linearised model.
        hypotheses: its hypotheses.
        fit: the refitted twin.
        other: whether there is an unknown effect besides.
    """
    seen, priors = hypotheses.like_any, hypotheses.priors
    response = linear.residual - fit.residual
    left = seen.turn @ linear.space.projected(fit.residual)
    form = seen.turn @ linear.space.projected(linear.parts * response).T  # (q, g)
    size = float(np.linalg.norm(linear.space.projected(response)))
    found = [
        -0.5 * (float(rest.products(left[:, None])[0, 0]) + rest.volume)
        for rest in covariances_of_rest(seen, form, size, priors, other)
    ]
    known = np.sqrt(np.diag(fit.covariance))[len(fit.at) :]
    occam = float(np.log(np.minimum(known / fit.width, 1.0)).sum() - 0.5 * ((fit.values / fit.width) ** 2).sum())
    return float(logsumexp(found) - np.log(len(found))) + occam
