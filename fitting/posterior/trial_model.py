"""The gait of one trial as a function of the coefficients, and what else may have moved it."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from fitting.posterior.gait import HARMONICS, Gait, advanced, phase_between
from fitting.posterior.noise import GaitNoise, noise_of
from fitting.trial import MeasuredTrial
from swimmer import MarkerKinematics, Runs, Trajectories, Twin

START_SD = (0.01, 0.02, 0.2)  # of the head's velocity at time 0: along, across (m/s), yaw (rad/s)
PHASE_SD_RAD = 0.5  # of the crank's phase beside the one that puts the tail in step
GLUED_SD_M = 0.001  # of a marker from its place on the body, each way: the same in all trials
PLACE_SD_M = 0.05  # of the whole fish beside its smooth path
LEAST_FREQUENCY_SE = 1e-4  # relative
_PHASE_COLUMN = -3  # of what nuisances of a trial do
_SHIFT_M, _START_STEP, _FREQUENCY_STEP = 1e-3, (0.01, 0.01, 0.1), 0.005


@dataclass(frozen=True, eq=False)
class TrialModel:
    """One trial beside the twin, both as gaits of length k.

    Attributes:
        twin: with the trial's markers.
        trial: as measured.
        phase_rad: crank phase that simulations start from; they are then put in step.
    """

    twin: Twin
    trial: MeasuredTrial
    phase_rad: float

    @cached_property
    def gait(self) -> Gait:
        """The reader."""
        return Gait.of(self.trial)

    @cached_property
    def measured(self) -> np.ndarray:
        """(k,) the measured gait."""
        return self.gait(self._kept(self.trial.position_m))

    @cached_property
    def noise(self) -> GaitNoise:
        """Of the tracks."""
        return noise_of(self.gait, self._kept(self.trial.position_m))

    @cached_property
    def noise_covariance(self) -> np.ndarray:
        """(k, k) of the measured gait."""
        return self.noise.covariance(self.gait)

    def simulated(self, coefficients: np.ndarray) -> np.ndarray:
        """(s, k) gaits of coefficients (s, 5), in step with the measured tail; nan where the twin diverged."""
        return self._in_step(self.gait(self._positions(coefficients)))

    def freedoms(self, coefficients: np.ndarray) -> "Freedoms":
        """By how much the gait moves with one standard deviation of each nuisance, at coefficients (5,).

        Of the trial: velocity at time 0, frequency, phase, and where the fish is; and, by the metre, where each box
        sits on its marker (with the scale and the heading that go with the boxes of nose and neck). Of the session:
        where each marker sits on the body.
        """
        one = coefficients[None]
        trajectories = self._simulate(one)
        marker_m = self._kept(trajectories.marker_m[0])  # (n, m, 2)
        gait = self._in_step(self.gait(marker_m))
        kinematics = MarkerKinematics(self.twin.robot, self.trial.markers)
        body = self._kept(kinematics.axes(trajectories.head[0], trajectories.hinges_rad[0]))  # (n, m, 2, 2)
        pool = np.broadcast_to(np.eye(2), body.shape)
        own = [*self._of_start(one), PHASE_SD_RAD * _slope_of_phase(gait), *_of_place(len(gait))]
        boxes = self._of_shifts(marker_m, pool, gait)
        shared = [GLUED_SD_M * column for column in self._of_shifts(marker_m, body, gait)]
        return Freedoms(np.column_stack(own), np.column_stack(boxes), np.column_stack(shared))

    def _of_start(self, one: np.ndarray) -> list[np.ndarray]:
        moved = []
        for axis, step in enumerate(_START_STEP):
            shift = np.zeros(3)
            shift[axis] = step
            up, down = (self._in_step(self.gait(self._positions(one, shift=sign * shift)))[0] for sign in (1, -1))
            moved.append(START_SD[axis] * (up - down) / (2 * step))
        up, down = (self._in_step(self.gait(self._positions(one, 1 + s * _FREQUENCY_STEP)))[0] for s in (1, -1))
        frequency = self.trial.frequency
        relative = max(frequency.se_hz / frequency.hz, LEAST_FREQUENCY_SE) if np.isfinite(frequency.se_hz) else 0.01
        return [*moved, relative * (up - down) / (2 * _FREQUENCY_STEP)]

    def _of_shifts(self, marker_m: np.ndarray, axes: np.ndarray, gait: np.ndarray) -> list[np.ndarray]:
        """The slope with each marker's shift along each of its axes (n, m, 2, 2), 1/m.

        The tracks are scaled by the distance between nose and neck, so a shift of either scales all.
        """
        slopes, nose, neck = [], self.gait.nose, self.gait.neck
        length = np.linalg.norm(marker_m[:, nose] - marker_m[:, neck], axis=-1).mean()
        for marker in range(marker_m.shape[1]):
            for axis in range(2):
                shifted = np.array(marker_m)
                shifted[:, marker] += _SHIFT_M * axes[:, marker, axis]
                shifted *= length / np.linalg.norm(shifted[:, nose] - shifted[:, neck], axis=-1).mean()
                slopes.append((self._in_step(self.gait(shifted)) - gait) / _SHIFT_M)
        return slopes

    def _in_step(self, gait: np.ndarray) -> np.ndarray:
        return advanced(gait, phase_between(gait, self.measured, list(self.trial.tail)))

    def _positions(self, coefficients: np.ndarray, faster: float = 1.0, shift: np.ndarray | None = None) -> np.ndarray:
        return self._kept(self._simulate(coefficients, faster, shift).marker_m)

    def _simulate(self, coefficients: np.ndarray, faster: float = 1.0, shift: np.ndarray | None = None) -> Trajectories:
        count, trial = len(coefficients), self.trial
        velocity = trial.start_velocity + (0.0 if shift is None else shift)
        runs = Runs(
            coefficients=np.ascontiguousarray(coefficients),
            frequency_hz=np.full(count, faster * trial.frequency.hz),
            phase_rad=np.full(count, self.phase_rad),
            velocity=np.tile(velocity, (count, 1)),
            turns=None if trial.turn is None else (trial.turn.shifted(0.0, faster),) * count,
        )
        last = int(np.flatnonzero(trial.kept)[-1]) + 1
        return self.twin.simulate(runs, trial.time_s[:last], allow_divergence=True)

    def _kept(self, series: np.ndarray) -> np.ndarray:
        """The kept frames of positions (n, m, 2) or (s, n, m, 2), or of axes (n, m, 2, 2)."""
        axis = 1 if series.ndim == 4 and series.shape[-2:] != (2, 2) else 0
        return np.compress(self.trial.kept[: series.shape[axis]], series, axis=axis)


class Freedoms(NamedTuple):
    """(k, q) columns: what nuisances of the trial do to its gait, boxes 1 m off their markers, those of the session."""

    own: np.ndarray
    boxes: np.ndarray
    shared: np.ndarray

    @property
    def in_step(self) -> np.ndarray:
        """(k, q - 1) `own` without the phase."""
        return np.delete(self.own, _PHASE_COLUMN, axis=1)


def _slope_of_phase(gait: np.ndarray) -> np.ndarray:
    step = 1e-4
    return (advanced(gait, step) - advanced(gait, -step)) / (2 * step)


def _of_place(length: int) -> list[np.ndarray]:
    """The mean of all markers, along and across."""
    columns = []
    for axis in range(2):
        column = np.zeros(length)
        column[1:].reshape(-1, 2, 1 + 2 * HARMONICS)[:, axis, 0] = PLACE_SD_M
        columns.append(column)
    return columns
