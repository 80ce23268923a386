"""The published objective: mean marker distance in the head frame over all fit trials jointly.

The parameters are the five coefficients and the crank phase of each trial; each trial's crank makes its measured
turn, or turns evenly at the measured frequency. Every column of parameters is one simulation of each trial, run in one
batch on all cores.
"""

from dataclasses import dataclass

import numpy as np

from fitting.in_pool import head_frame
from fitting.scoring import residuals
from fitting.trial import MeasuredTrial
from swimmer import Runs, Twin
from tracking import HeadFrame

COEFFICIENT_BOUNDS = (0.0, 10.0)
LOST_M = 1.0  # distance assigned to a simulation that diverged


@dataclass(frozen=True, eq=False)
class Swims:
    """The trials a set of parameters is compared with, and the twin that swims them.

    Attributes:
        twin: with the markers of the trials.
        trials: to be compared with.
    """

    twin: Twin
    trials: tuple[MeasuredTrial, ...]

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

    def mean_distance(self, parameters: np.ndarray) -> np.ndarray:
        """(s,) the objective for (p, s) parameters: mean distance a trial, mean over trials, m.

        Args:
            parameters: (p, s) coefficients, then a phase a trial (rad).
        """
        total = np.zeros(parameters.shape[1])
        for trial, head in zip(self.trials, self.simulate(parameters), strict=True):
            distance = np.linalg.norm(residuals(trial, head, trial.scored), axis=-1)  # (s, k, m)
            good = trial.weight[trial.scored] > 0
            total += np.nan_to_num(distance[:, good], nan=LOST_M).mean(axis=1)
        return total / len(self.trials)
