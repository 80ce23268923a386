"""The published objective, made smooth: mean marker distance in the head frame over all fit trials jointly.

The parameters are the five coefficients and the crank phase of each trial; each trial's crank makes its measured
turn, or turns evenly at the measured frequency. Every column of parameters is one simulation of each trial, run in one
batch on all cores.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from fitting.in_pool import head_frame
from fitting.mean_distance import SOFTENING_M, MeanDistance
from fitting.placement import placed_residuals
from fitting.scoring import residuals
from fitting.trial import MeasuredTrial
from swimmer import Runs, Twin
from tracking import HeadFrame

COEFFICIENT_BOUNDS = (0.0, 10.0)
LOST_M = 1.0  # distance that stands for a simulation that blew up


Comparison = Literal["published", "shape", "yaw", "placed"]


@dataclass(frozen=True, eq=False)
class Swims:
    """The trials a set of parameters is compared with, and the twin that swims them.

    Attributes:
        twin: with the markers of the trials.
        trials: to be compared with.
        comparison: "published": distance in the head frame, aligned at the first scored frame. "shape": relative to
            the nose in every frame, so that a drift of the path does not hide the tail. "yaw": as published, after
            one turn of each trial's head frame about its nose, the best one for the simulation at hand (the nose and
            neck boxes are placed by hand, so the measured axis may be off by some degrees). "placed": as published,
            with boxes where they most likely were put (see `fitting.placement`).
    """

    twin: Twin
    trials: tuple[MeasuredTrial, ...]
    comparison: Comparison = "published"

    @property
    def by_name(self) -> np.ndarray:
        """(t,) the order of the trials by name, in which searches see them: draws go by a trial's place."""
        return np.argsort([trial.name for trial in self.trials], kind="stable")

    def with_trials(self, order: np.ndarray) -> "Swims":
        """The same with the trials in another order (t,)."""
        return replace(self, trials=tuple(self.trials[i] for i in order))

    def simulate(self, parameters: np.ndarray) -> list[HeadFrame]:
        """Head frames (s, k, m, 2) of each trial for s columns of parameters (p, s); what diverges is nan.

        All trials run in one batch, each until the last of its k frames that is scored.
        """
        count, frames = parameters.shape[1], [int(np.flatnonzero(t.scored)[-1]) + 1 for t in self.trials]
        times = [
            np.pad(t.time_s[:n], (0, max(frames) - n), mode="edge") for t, n in zip(self.trials, frames, strict=True)
        ]
        runs = Runs(
            coefficients=np.tile(parameters[:5].T, (len(self.trials), 1)),
            frequency_hz=np.repeat([t.frequency.hz for t in self.trials], count),
            phase_rad=parameters[5:].reshape(-1),
            velocity=np.repeat([t.start_velocity for t in self.trials], count, axis=0),
            turns=tuple(t.turn for t in self.trials for _ in range(count)),
        )
        marker_m = self.twin.simulate(runs, np.repeat(times, count, axis=0), allow_divergence=True).marker_m
        parts = np.split(marker_m, len(self.trials))
        return [head_frame(self.twin.markers, part[:, :n]) for part, n in zip(parts, frames, strict=True)]

    def errors(self, parameters: np.ndarray) -> np.ndarray:
        """(2 e, s) components of the e weighted marker errors, m: x and y of one marker follow each other.

        Args:
            parameters: (p, s) coefficients, then a phase a trial (rad).
        """
        parts = []
        for trial, compared in zip(self.trials, self.compare(self.simulate(parameters)), strict=True):
            error = compared[:, trial.weight[trial.scored] > 0]  # (s, e, 2)
            parts.append(np.nan_to_num(error, nan=LOST_M).reshape(len(error), -1).T)
        return np.concatenate(parts)

    def compare(self, simulated: Sequence[HeadFrame]) -> list[np.ndarray]:
        """(s, k, m, 2) simulated minus measured over the k scored frames of each trial, m."""
        if self.comparison == "placed":
            return placed_residuals(self.trials, simulated)
        return [self._compare(*each) for each in zip(self.trials, simulated, strict=True)]

    def _compare(self, trial: MeasuredTrial, simulated: HeadFrame) -> np.ndarray:
        if self.comparison == "shape":
            frames = trial.scored[: simulated.shape_m.shape[-3]]
            return simulated.shape_m[..., frames, :, :] - trial.head.shape_m[trial.scored]
        error = residuals(trial, simulated, trial.scored)
        if self.comparison == "published":
            return error
        measured = _measured(trial)
        return error + measured - turn(measured, _yaw(trial, error)[:, None, None])

    def yaws(self, parameters: np.ndarray) -> np.ndarray:
        """(s, t) best turn of each trial's measured head frame for (p, s) parameters, rad, counter-clockwise."""
        pairs = zip(self.trials, self.simulate(parameters), strict=True)
        return np.stack([_yaw(trial, residuals(trial, head, trial.scored)) for trial, head in pairs], axis=1)

    @property
    def norm(self) -> MeanDistance:
        """The objective as a function of the errors: the mean over trials of the mean over samples."""
        weights = [trial.weight[trial.scored] for trial in self.trials]
        return MeanDistance(np.concatenate([w[w > 0] / (len(weights) * w.sum()) for w in weights]))

    def mean_distance(self, parameters: np.ndarray) -> np.ndarray:
        """(s,) the objective itself for (p, s) parameters: mean distance a trial, mean over trials, m."""
        total = np.zeros(parameters.shape[1])
        for trial, compared in zip(self.trials, self.compare(self.simulate(parameters)), strict=True):
            distance = np.linalg.norm(compared, axis=-1)  # (s, k, m)
            good = trial.weight[trial.scored] > 0
            total += np.nan_to_num(distance[:, good], nan=LOST_M).mean(axis=1)
        return total / len(self.trials)


def _measured(trial: MeasuredTrial) -> np.ndarray:
    """(k, m, 2) markers of the scored frames in the head frame, displacement counted from the first, m."""
    path = trial.head.path_m[trial.scored]
    return trial.head.shape_m[trial.scored] + (path - path[0])[:, None, :]


def _yaw(trial: MeasuredTrial, error: np.ndarray) -> np.ndarray:
    """(s,) best turn of a trial's head frame for residuals (s, k, m, 2) over the scored frames, rad."""
    measured = _measured(trial)
    return best_yaw(error + measured, measured, trial.weight[trial.scored])


def best_yaw(simulated: np.ndarray, measured: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """(s,) turn of the measured markers (k, m, 2) that brings them closest to simulated ones (s, k, m, 2), rad.

    Closest in mean distance: a weighted Procrustes rotation about the origin, reweighted a few times.
    """
    known, weight = np.nan_to_num(measured), np.where(np.isfinite(measured).all(axis=-1), weight, 0.0)
    angle = np.zeros(len(simulated))
    for _ in range(4):
        distance = np.linalg.norm(simulated - turn(known, angle[:, None, None]), axis=-1)
        pull = np.nan_to_num(weight / np.sqrt(distance**2 + SOFTENING_M**2))
        cross = known[..., 0] * simulated[..., 1] - known[..., 1] * simulated[..., 0]
        dot = (known * simulated).sum(axis=-1)
        angle = np.arctan2((pull * np.nan_to_num(cross)).sum(axis=(1, 2)), (pull * np.nan_to_num(dot)).sum(axis=(1, 2)))
    return angle


def turn(points: np.ndarray, angle_rad: np.ndarray) -> np.ndarray:
    """(..., 2) points turned counter-clockwise about the origin; the angles broadcast against the leading axes."""
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    x, y = points[..., 0], points[..., 1]
    return np.stack([x * cos - y * sin, x * sin + y * cos], axis=-1)
