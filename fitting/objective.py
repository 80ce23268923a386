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
from fitting.mean_distance import MeanDistance
from fitting.placement import placed_residuals
from fitting.scoring import residuals
from fitting.trial import MeasuredTrial
from swimmer import Runs, Twin
from tracking import HeadFrame

COEFFICIENT_BOUNDS = (0.0, 10.0)
LOST_M = 1.0  # distance that stands for a simulation that blew up


Comparison = Literal["published", "shape", "placed"]


@dataclass(frozen=True, eq=False)
class Swims:
    """The trials a set of parameters is compared with, and the twin that swims them.

    Attributes:
        twin: with the markers of the trials.
        trials: to be compared with.
        comparison: "published": distance in the head frame, aligned at the first scored frame. "shape": relative to
            the nose in every frame, so that a drift of the path does not hide the tail. "placed": as published, with
            boxes where they most likely were put (see `fitting.placement`).
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
        if self.comparison == "shape":
            return [
                head.shape_m[..., t.scored[: head.shape_m.shape[-3]], :, :] - t.head.shape_m[t.scored]
                for t, head in zip(self.trials, simulated, strict=True)
            ]
        return [residuals(t, head, t.scored) for t, head in zip(self.trials, simulated, strict=True)]

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
