"""A withheld session without noise, as a diagnosis would see it: rows of gaits, and all that disturbs them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from calib.benchmarks.effects.drawn import GLUED_SD_M, DrawnWorld
from calib.benchmarks.effects.suite import WARMUP_S
from diagnosis.described import robot_doubts
from diagnosis.discrepancy import Discrepancy
from fitting.posterior.gait import advanced, phase_between
from fitting.posterior.noise import GaitNoise
from fitting.posterior.session_model import START_PHASE_RAD, PlacesOff, SessionModel
from fitting.posterior.trial_model import TrialModel
from fitting.signatures import Signature, Whitened, signature_of
from fitting.signatures.session_row import LONG, PRIOR_SD, left_row, nearest, row_covariance, row_slopes
from fitting.trial import MeasuredTrial, measure_trial
from reality import PixelNoise, Recording
from session import FISHSIM_MARKERS, CameraSpec, Tracks, TrialSpec
from swimmer import Twin, load_robot
from swimmer.effects import Effect, catalogue


class Change(NamedTuple):
    """What something in the water changes of a session's row, and how far coefficients follow it about some place.

    Attributes:
        row: (k,) at the coefficients of the base state, as slopes at that place have it.
        space: of these slopes, in which all that disturbs the row has unit size.
        at: (5,) the place.
    """

    row: np.ndarray
    space: Whitened
    at: np.ndarray


@dataclass(frozen=True, eq=False)
class SessionRows:
    """The swims of one role of a session in its base state beside the twin.

    Attributes:
        drawn: the session.
        role: of the swims that are in the rows.
        model: these swims, without noise, beside the plain twin.
        discrepancy: what the refitted twin leaves in the base state.
        given: (5,) coefficients that other swims gave; None where these give them.
    """

    drawn: DrawnWorld
    role: str
    model: SessionModel
    discrepancy: Discrepancy
    given: np.ndarray | None = None

    @classmethod
    def of(
        cls,
        drawn: DrawnWorld,
        base: Mapping[str, Recording],
        discrepancy: Discrepancy,
        role: str = "fit",
        given: np.ndarray | None = None,
    ) -> "SessionRows":
        """From recordings of the base state of all trials, without noise."""
        twin = Twin(load_robot(), FISHSIM_MARKERS, workers=1)
        doubted = robot_doubts(twin)
        trials = (TrialModel(twin, trial, START_PHASE_RAD, doubted) for trial in measured(drawn, base, role))
        return cls(drawn, role, SessionModel(tuple(trials)), discrepancy, given)

    @cached_property
    def coefficients(self) -> np.ndarray:
        """(5,) of the twin that comes nearest to the base state, by Gauss and Newton."""
        if self.given is not None:
            return self.given
        start = np.array(self.drawn.world.coefficients, float)
        covariance = self._covariance(start)
        return nearest(self.model, start, covariance)

    @cached_property
    def left(self) -> np.ndarray:
        """(k,) what the refitted twin leaves of the base state."""
        return left_row(self.model, self.coefficients)

    @property
    def left_of_gaits(self) -> np.ndarray:
        """(t, 127) what it leaves of each swim's gait."""
        count = len(self.model.trials)
        return self.left[:-count].reshape(count, -1)

    @cached_property
    def tracking(self) -> np.ndarray:
        """(k, k) covariance of the gaits with the noise of the tracker as it is."""
        return block_diag(*[_noise(model, self.drawn.world.noise) for model in self.model.trials])

    @cached_property
    def space(self) -> Whitened:
        """In which all that disturbs the row has unit size."""
        at = self.coefficients
        looks_like = {name: effect for name, effect in catalogue().items() if name in self.discrepancy.strengths}
        alike = self.discrepancy.alike(self.signatures(looks_like))
        return Whitened.of(self._covariance(at) + alike @ alike.T, row_slopes(self.model, at), PRIOR_SD)

    def changes(self, recordings: Mapping[str, Recording]) -> tuple[Change, ...]:
        """What other recordings of the same trials change, about the coefficients of the base state.

        Where coefficients would have to go far to follow it, which they do not in a straight line, there is a second:
        about those of the twin that is refitted in truth. What follows either way comes as near as the nearer of them.
        """
        about_base = self.change(recordings)
        step = about_base.space.coefficients(about_base.row) if np.isfinite(about_base.row).all() else np.zeros(5)
        if about_base.space.moved(step) <= LONG:
            return (about_base,)
        try:
            at = nearest(self._beside(recordings), self.coefficients, self._covariance(self.coefficients))
            about_refitted = self.change(recordings, at)
        except (np.linalg.LinAlgError, ValueError):  # a twin diverged on the way, and what it leaves is not finite
            return (about_base,)
        return (about_base, about_refitted) if np.isfinite(about_refitted.row).all() else (about_base,)

    def change(self, recordings: Mapping[str, Recording], at: np.ndarray | None = None) -> Change:
        """What other recordings of the same trials change of what the twin leaves.

        The twin beats at the frequency of either; how far that is from the base state stands behind the gaits. Rows are
        compared at one phase of the beat: what the twin leaves turns with it, and that is no effect.

        Args:
            recordings: by name.
            at: (5,) coefficients about which these may follow; default: of the base state.
        """
        at = self.coefficients if at is None else at
        others = self._beside(recordings)
        row = self._turned_back(left_row(others, at), others.trials) - self.left
        if np.array_equal(at, self.coefficients):
            return Change(row, self.space, at)
        space = replace(self.space, slopes=row_slopes(self.model, at))
        return Change(row + space.slopes @ (at - self.coefficients), space, at)

    def _beside(self, recordings: Mapping[str, Recording]) -> SessionModel:
        """Other recordings of the same trials beside the same twin."""
        others = measured(self.drawn, recordings, self.role)
        return SessionModel(
            tuple(replace(model, trial=trial) for model, trial in zip(self.model.trials, others, strict=True))
        )

    def _turned_back(self, row: np.ndarray, models: Sequence[TrialModel]) -> np.ndarray:
        """(k,) gaits at the phase of the base state."""
        count, tail = len(models), list(models[0].trial.tail)
        gaits = row[:-count].reshape(count, -1)
        ahead = [
            float(phase_between(base.measured, other.measured, tail))
            for base, other in zip(self.model.trials, models, strict=True)
        ]
        return np.append(np.concatenate([advanced(g, -by) for g, by in zip(gaits, ahead, strict=True)]), row[-count:])

    def signatures(self, effects: Mapping[str, Effect]) -> list[Signature]:
        """What every effect does to the refitted twin; asked again, an effect of the same name is not simulated."""
        camera = camera_of(self.drawn)
        for name in effects.keys() - self._signatures.keys():
            self._signatures[name] = signature_of(effects[name], self.model, camera, self.coefficients)
        return [self._signatures[name] for name in effects]

    @cached_property
    def _signatures(self) -> dict[str, Signature]:
        return {}

    def _covariance(self, at: np.ndarray) -> np.ndarray:
        """(k, k) of tracking noise, boxes, nuisances and the discrepancy of the base state."""
        noise = self.drawn.world.noise
        scale = float(np.mean([model.trial.metres_per_px for model in self.model.trials]))
        off = PlacesOff(noise.placement_sd_px * scale, GLUED_SD_M)
        disturbed = self.model.disturbances(at, self.tracking).of(off)
        return row_covariance(self.model, disturbed + self.discrepancy.over(self.model))


def measured(drawn: DrawnWorld, recordings: Mapping[str, Recording], role: str) -> list[MeasuredTrial]:
    """The swims of a role, from recordings by name, as they are, without noise."""
    camera, measured_trials = camera_of(drawn), []
    for each in drawn.swims(role):
        spec = TrialSpec(name=each.name, kind="swim", commanded_hz=each.commanded_hz, role=each.role)  # type: ignore[arg-type]
        tracks = tracks_of(recordings[each.name], recordings[each.name].position_px)
        measured_trials.append(measure_trial(spec, tracks, camera, load_robot(), WARMUP_S))
    return measured_trials


def tracks_of(recording: Recording, position_px: np.ndarray) -> Tracks:
    """Tracks with every marker seen."""
    return Tracks(recording.markers, recording.time_s, position_px, np.ones(position_px.shape[:2]))


def camera_of(drawn: DrawnWorld) -> CameraSpec:
    """What the session says of its camera."""
    fps = drawn.trials[0].trial.fps
    return CameraSpec(fps=fps, scale_length_m=load_robot().scale_length_m)


def _noise(model: TrialModel, noise: PixelNoise) -> np.ndarray:
    """(127, 127) covariance of a gait with the noise of the tracker as it is; rounding counts as white."""
    lasting, rounding = noise.sd_px**2, noise.grid_px**2 / 12
    white = rounding / (lasting + rounding)
    lag_s = np.abs(model.gait.time_s[:, None] - model.gait.time_s)
    correlation = (1 - white) * np.exp(-lag_s / noise.correlation_s) + white * np.eye(len(lag_s))
    sd_m = np.full(model.gait.usable.shape[1], np.sqrt(lasting + rounding) * model.trial.metres_per_px)
    return GaitNoise(sd_m, noise.correlation_s, white, correlation).covariance(model.gait)
