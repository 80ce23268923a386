"""Withheld session without noise, as a diagnosis would see it: rows of features, and all that disturbs them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.linalg import block_diag, solve_triangular
from scipy.optimize import lsq_linear

from benchmarks.effects.drawn import GLUED_SD_M, DrawnWorld
from benchmarks.effects.suite import WARMUP_S
from benchmarks.reality import Recording
from benchmarks.reality.camera import PixelNoise
from diagnosis.constants import perturbed_robots
from diagnosis.discrepancy import Discrepancy
from diagnosis.linear_model import LinearModel
from fitting.features import advance_phase, phase_between
from fitting.measure_trial import measure_trial
from fitting.mode import broyden
from fitting.noise import FeatureNoise, NoisePart
from fitting.session_model import PlacementUncertainty, SessionModel
from fitting.signatures import (
    LONG,
    PRIOR_SD,
    Piece,
    Signature,
    Whitened,
    pieces,
    residual_row,
    row_covariance,
    row_slopes,
    signature_of,
)
from fitting.trial import MeasuredTrial
from fitting.trial_model import TrialModel
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.effects.catalogue import catalogue
from swimcal.effects.effect import Effect
from swimcal.mjcf import COEFFICIENT_BOUNDS
from swimcal.robot import load_robot
from swimcal.session import TrialSpec
from swimcal.session_file import CameraSpec
from swimcal.tracks import as_tracks
from swimcal.twin import Twin

_ROUNDS = 7  # A refit takes at most this many steps.
_DAMPING = 0.8  # Only this share of a step is taken, as the twin is not linear.
_STEP_TOLERANCE = 0.1  # A shorter step is the last, in whitened length.
_MAX_FREE_PARAMETERS = 2  # An effect of more parameters would have too many choices of pieces.


class Change(NamedTuple):
    """Change of a session's row by something in the water, seen from some coefficients."""

    # (k,) The residual there minus that of the base state, brought back along the Jacobian of `space` to the
    # coefficients of the base state.
    row: np.ndarray
    space: Whitened  # whitened space with slopes there; all that disturbs the row has unit size
    step: np.ndarray  # (5,) step from the coefficients of the base state to these

    def strays(self, row: np.ndarray) -> float:
        """Return how far from these coefficients, whitened, those are that best make up for a row (k,)."""
        return moved(self.space, self.space.coefficients(row) - self.step)


def moved(space: Whitened, change: np.ndarray) -> float:
    """Return by how much a change (5,) of the coefficients moves the row, with the prior's distance."""
    white = solve_triangular(space.root, space.slopes @ change, lower=True)
    return float(np.sqrt(white @ white + space.precision @ change**2))


def nearest(model: SessionModel, start: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Fit the (5,) coefficients of the nearest twin, by Gauss-Newton.

    The Jacobian is simulated at the start and after long steps, and updated (Broyden) after short ones.

    Args:
        model: the swims.
        start: (5,) coefficients to start from.
        covariance: (k + b, k + b) covariance of the row.
    """
    at = np.array(start, float)
    residual, slopes = residual_row(model, at), row_slopes(model, at)
    for _ in range(_ROUNDS):
        space = Whitened.of(covariance, slopes, PRIOR_SD)
        before, at = at, np.clip(at + _DAMPING * space.coefficients(residual), *COEFFICIENT_BOUNDS)
        step = at - before
        length = moved(space, step)
        if length < _STEP_TOLERANCE:
            break
        before_step, residual = residual, residual_row(model, at)
        slopes = (
            row_slopes(model, at)
            if length > LONG
            else broyden(slopes, step, before_step - residual, step * PRIOR_SD**-2.0)
        )
    return at


class ClosestFit(NamedTuple):
    """Closest fit of several effects, or of none."""

    values: list[np.ndarray]  # (p,) parameters of each effect
    distance: float  # whitened, coefficients refitted; d in the two-way error Phi(-d / 2)
    residual: np.ndarray  # (k,) residual of the row without the effects, coefficients as they were


def closest_fit_of(space: Whitened, row: np.ndarray, signatures: Sequence[Signature]) -> ClosestFit:
    """Fit the parameters of effects that together come nearest to a change (k,), within their bounds.

    Each parameter is linear over each of its pieces; those of all effects that come nearest are taken.
    """
    target = space.projected(row)
    best, residual = [np.zeros(len(each.effect.parameters)) for each in signatures], row
    nearest = float(np.linalg.norm(target))
    choices = [chosen for chosen in product(*map(_list_choices, signatures)) if any(chosen)]
    every = {id(piece): piece for chosen in choices for way in chosen for piece in way.values()}
    if not every:
        return ClosestFit(best, nearest, residual)
    basis, columns = np.linalg.qr(space.projected(np.array([piece.slope for piece in every.values()])).T)
    column = dict(zip(every, columns.T, strict=True))
    within = basis.T @ target
    beside = max(nearest**2 - float(within @ within), 0.0)
    for chosen in choices:
        own = [piece for way in chosen for piece in way.values()]
        bounds = ([piece.low for piece in own], [piece.high for piece in own])
        found = lsq_linear(np.column_stack([column[id(piece)] for piece in own]), within, bounds)
        distance = float(np.sqrt(2 * found.cost + beside))
        if distance < nearest:
            nearest, values = distance, iter(found.x)
            residual = row - np.column_stack([piece.slope for piece in own]) @ found.x
            for each, way in zip(best, chosen, strict=True):
                each[:] = 0.0
                each[list(way)] = [next(values) for _ in way]
    return ClosestFit(best, nearest, residual)


def _list_choices(signature: Signature) -> list[dict[int, Piece]]:
    """List all choices of one piece of each parameter that shows, by its number.

    Of an effect of more than two parameters, of which there would be too many, two: for all strengths the slopes of the
    least, and of the largest that were tried.
    """
    every = {number: pieces(signature, number) for number in range(signature.values.shape[1])}
    every = {number: own for number, own in every.items() if own}
    if len(every) <= _MAX_FREE_PARAMETERS:
        return [dict(zip(every, chosen, strict=True)) for chosen in product(*every.values())]
    return [{number: _merge_pieces(own, size) for number, own in every.items()} for size in (min, max)]


def _merge_pieces(own: Sequence[Piece], size: Callable[..., Piece]) -> Piece:
    """Return one piece for all strengths, with the slope of the least or the largest."""
    like = size(own, key=lambda piece: max(piece.low, -piece.high))
    return Piece(own[0].low, own[-1].high, like.slope)


def closest_fit(changes: Sequence[Change], signatures: Sequence[Signature]) -> tuple[int, ClosestFit]:
    """Return the number of the change to which some effects, or none, come closest, and that closest fit.

    Seen from where coefficients end nearest to those that they are seen from: farther off the twin is not linear.
    """
    found = [closest_fit_of(change.space, change.row, signatures) for change in changes]
    number = min(range(len(changes)), key=lambda i: changes[i].strays(found[i].residual))
    return number, found[number]


@dataclass(frozen=True, eq=False)
class SessionRows:
    """Swims of one role of a session in its base state, with the twin."""

    drawn: DrawnWorld  # session of the rows
    role: str  # role of the swims that are in the rows
    model: SessionModel  # model of these swims, without noise, with the plain twin
    discrepancy: Discrepancy  # residual of the refitted twin in the base state
    given: np.ndarray | None = None  # (5,) coefficients that other swims gave; None where these give them

    @classmethod
    def of(
        cls,
        drawn: DrawnWorld,
        base: Mapping[str, Recording],
        discrepancy: Discrepancy,
        role: str = "fit",
        given: np.ndarray | None = None,
    ) -> "SessionRows":
        """Build the rows from recordings of the base state of all trials, without noise."""
        twin = Twin(load_robot(), FISHSIM_MARKERS, workers=1)
        doubted = perturbed_robots(twin)
        trials = (TrialModel.of(twin, trial, doubted) for trial in measured(drawn, base, role))
        return cls(drawn, role, SessionModel(tuple(trials)), discrepancy, given)

    @cached_property
    def coefficients(self) -> np.ndarray:
        """(5,) coefficients of the twin that comes nearest to the base state, by Gauss and Newton."""
        if self.given is not None:
            return self.given
        start = np.array(self.drawn.world.coefficients, float)
        return nearest(self.model, start, self._compute_covariance(start))

    @cached_property
    def residual(self) -> np.ndarray:
        """(k,) residual of the refitted twin in the base state."""
        return residual_row(self.model, self.coefficients)

    @property
    def residual_features(self) -> np.ndarray:
        """(t, 127) residual of the features of each swim."""
        count = len(self.model.trials)
        return self.residual[:-count].reshape(count, -1)

    @cached_property
    def tracking(self) -> np.ndarray:
        """(k, k) covariance of the features with the noise of the tracker as it is."""
        return block_diag(*[_compute_noise(model, self.drawn.world.noise) for model in self.model.trials])

    @cached_property
    def space(self) -> Whitened:
        """Space in which all that disturbs the row has unit size."""
        looks_like = {name: effect for name, effect in catalogue().items() if name in self.discrepancy.strengths}
        common = self.discrepancy.common_columns(self.signatures(looks_like))
        return Whitened.of(
            self._base_covariance + common @ common.T, row_slopes(self.model, self.coefficients), PRIOR_SD
        )

    def changes(self, recordings: Mapping[str, Recording]) -> tuple[Change, ...]:
        """Return what other recordings of the same trials change, seen from the coefficients of the base state.

        Where coefficients would have to go far to follow it, which they do not in a straight line, also from those of
        the twin that is refitted to these recordings in truth.
        """
        others = self._build_model(recordings)
        from_base = self._compute_change(others, self.coefficients)
        if not np.isfinite(from_base.row).all() or from_base.strays(from_base.row) <= LONG:
            return (from_base,)
        try:
            refitted = self._compute_change(others, self._find_nearest(others, self._compute_turns(others)))
        except (np.linalg.LinAlgError, ValueError):  # a twin diverged on the way, and what it leaves is not finite
            return (from_base,)
        return (from_base, refitted) if np.isfinite(refitted.row).all() else (from_base,)

    def refitted(self, recordings: Mapping[str, Recording]) -> np.ndarray:
        """Return (5,) coefficients of the plain twin that comes nearest to other recordings of the same trials.

        The residual of the base state is subtracted first.

        Raises:
            ValueError, LinAlgError: a twin diverged on the way.
        """
        others = self._build_model(recordings)
        return self._find_nearest(self._subtract_base(others, with_course=False), self._compute_turns(others))

    def _find_nearest(self, others: SessionModel, turns: np.ndarray) -> np.ndarray:
        return nearest(others, self.coefficients, turns.T @ self._base_covariance @ turns)

    def linear(self, recordings: Mapping[str, Recording], at: np.ndarray) -> LinearModel:
        """Linearise other recordings of the same trials, without noise, as a diagnosis sees its swims.

        The residual of the base state is subtracted: where markers are glued, a form that moves
        markers would follow that too.

        Args:
            recordings: recordings of the trials, by name.
            at: (5,) coefficients of the plain twin.
        """
        model = self._subtract_base(self._build_model(recordings), with_course=True)
        noise = block_diag(*[_compute_noise(each, self.drawn.world.noise) for each in model.trials])
        camera = camera_of(self.drawn)
        return LinearModel(model, camera, at, self.discrepancy, self._placement, model.disturbances(at, noise))

    def _subtract_base(self, others: SessionModel, *, with_course: bool) -> SessionModel:
        """Return other recordings without the residual of the base state, at their own phases of the beat."""
        residual = self._residual_with_course if with_course else self.residual_features
        base = [advance_phase(own, ahead) for own, ahead in zip(residual, self._compute_leads(others), strict=True)]
        trials = (
            _Changed(each.twin, each.trial, each.phase_rad, each.doubted, with_course=with_course, base=own)
            for each, own in zip(others.trials, base, strict=True)
        )
        return SessionModel(tuple(trials))

    @cached_property
    def _residual_with_course(self) -> np.ndarray:
        """(t, k) residual of the base state, with course and sliding."""
        trials = tuple(replace(each, with_course=True) for each in self.model.trials)
        model = SessionModel(trials)
        return residual_row(model, self.coefficients)[: len(model.measured)].reshape(len(trials), -1)

    def _compute_change(self, others: SessionModel, at: np.ndarray) -> Change:
        """Return the change with each twin at its own beat; the difference in frequency comes after the features.

        Rows are compared at one phase of the beat: what the twin leaves turns with it, and that is no effect.
        """
        step = at - self.coefficients
        space = self.space if not step.any() else replace(self.space, slopes=row_slopes(self.model, at))
        residual = self._compute_turns(others) @ residual_row(others, at)
        return Change(residual - self.residual + space.slopes @ step, space, step)

    def _build_model(self, recordings: Mapping[str, Recording]) -> SessionModel:
        """Return other recordings of the same trials with the same twin."""
        others = measured(self.drawn, recordings, self.role)
        return SessionModel(
            tuple(replace(model, trial=trial) for model, trial in zip(self.model.trials, others, strict=True))
        )

    def _compute_turns(self, others: SessionModel) -> np.ndarray:
        """Return the (k, k) matrix that brings features of other recordings to the phase of the base state."""
        pairs = zip(self.model.trials, self._compute_leads(others), strict=True)
        turns = [advance_phase(np.eye(len(base.measured)), -ahead).T for base, ahead in pairs]
        return np.asarray(block_diag(*turns, np.eye(len(turns))))

    def _compute_leads(self, others: SessionModel) -> list[float]:
        """Return by how much the beat of other recordings is ahead of that of the base state, rad."""
        pairs = zip(self.model.trials, others.trials, strict=True)
        return [float(phase_between(base.measured, other.measured, list(base.trial.tail))) for base, other in pairs]

    def signatures(self, effects: Mapping[str, Effect]) -> list[Signature]:
        """Return what every effect does to the refitted twin; an effect is simulated once for its name."""
        camera = camera_of(self.drawn)
        for name in effects.keys() - self._signatures.keys():
            self._signatures[name] = signature_of(effects[name], self.model, camera, self.coefficients)
        return [self._signatures[name] for name in effects]

    @cached_property
    def _signatures(self) -> dict[str, Signature]:
        return {}

    @property
    def _placement(self) -> PlacementUncertainty:
        scale = float(np.mean([model.trial.metres_per_px for model in self.model.trials]))
        return PlacementUncertainty(self.drawn.world.noise.placement_sd_px * scale, GLUED_SD_M)

    @cached_property
    def _base_covariance(self) -> np.ndarray:
        return self._compute_covariance(self.coefficients)

    def _compute_covariance(self, at: np.ndarray) -> np.ndarray:
        """Return the (k, k) covariance of tracking noise, boxes, nuisances and the discrepancy of the base state."""
        disturbed = self.model.disturbances(at, self.tracking).of(self._placement)
        return row_covariance(self.model, disturbed + self.discrepancy.over(self.model))


@dataclass(frozen=True, eq=False)
class _Changed(TrialModel):
    """Swim without its residual in the base state."""

    base: np.ndarray = field(kw_only=True)  # (k,) residual in the base state, at the phase of this swim

    @cached_property
    def measured(self) -> np.ndarray:
        """(k,) features minus that residual."""
        return np.asarray(super().measured - self.base)


def measured(drawn: DrawnWorld, recordings: Mapping[str, Recording], role: str) -> list[MeasuredTrial]:
    """Measure the swims of a role, from recordings by name, as they are, without noise."""
    camera, measured_trials = camera_of(drawn), []
    for each in drawn.swims(role):
        spec = TrialSpec(name=each.name, kind="swim", commanded_hz=each.commanded_hz, role=each.role)  # type: ignore[arg-type]
        tracks = tracks_of(recordings[each.name], recordings[each.name].position_px)
        measured_trials.append(measure_trial(spec, tracks, camera, load_robot(), WARMUP_S))
    return measured_trials


def tracks_of(recording: Recording, position_px: np.ndarray) -> xr.Dataset:
    """Build tracks with every marker seen."""
    return as_tracks(recording.markers, recording.time_s, position_px, np.ones(position_px.shape[:2]))


def camera_of(drawn: DrawnWorld) -> CameraSpec:
    """Return the camera as the session describes it."""
    fps = drawn.trials[0].trial.fps
    return CameraSpec(fps=fps, scale_length_m=load_robot().scale_length_m)


def _compute_noise(model: TrialModel, noise: PixelNoise) -> np.ndarray:
    """Return the (127, 127) covariance of features with the tracker's noise as it is; rounding counts as white."""
    lasting, rounding = noise.sd_px**2, noise.grid_px**2 / 12
    white = rounding / (lasting + rounding)
    sd_m = np.full(model.reader.usable.shape[1], np.sqrt(lasting + rounding) * model.trial.metres_per_px)
    lasts = NoisePart(1 - white, noise.correlation_s, False, np.eye(len(sd_m)))
    return FeatureNoise(sd_m, [lasts], model.reader.time_s).covariance(model.reader)
