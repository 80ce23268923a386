"""The published objective as every search sees it: mean marker distance, what it cost so far, and the best so far.

A point counts as a new best only if its twin swims forward from rest (see `fitting.from_rest`), for all searches
alike; a point that would win but swims backward is handed back with a penalty.
"""

import numpy as np

from fitting.from_rest import seconds_from_rest, swims_forward
from fitting.objective import COEFFICIENT_BOUNDS, Swims, phase_from_harmonic
from fitting.scoring import residuals

FREE_TURNS_RAD = 100.0  # phases are free; optimisers ask for finite bounds
PENALTY = 1.5  # factor on the distance of what swims backward


class BudgetSpent(Exception):
    """Ends an optimiser that has no other way to stop."""


class PublishedObjective:
    """Mean marker distance over the fit trials (or relative to the nose), as a function of coefficients and phases.

    Args:
        swims: the fit trials and the twin.
        shape_only: compare relative to the nose in every frame, so that a drift in heading does not hide the tail.

    Attributes:
        spent_s: seconds simulated so far, the checks from rest included.
        evaluations: points evaluated so far.
        best_point: (p,) the best so far that swims forward; `best_m` its distance, m.
        trace: (spent_s, best_m) at every new best.
    """

    def __init__(self, swims: Swims, shape_only: bool = False) -> None:
        self.swims = swims
        self.shape_only = shape_only
        free = np.full(len(swims.trials), FREE_TURNS_RAD)
        self.bounds = (
            np.append(np.full(5, COEFFICIENT_BOUNDS[0]), -free),
            np.append(np.full(5, COEFFICIENT_BOUNDS[1]), free),
        )
        self.spent_s, self.evaluations = 0.0, 0
        self.best_m, self.best_point = np.inf, np.zeros(len(free) + 5)
        self.trace: list[tuple[float, float]] = []
        self._seconds = sum(float(t.time_s[t.scored][-1]) for t in swims.trials)
        self._seconds_from_rest = seconds_from_rest(swims.trials)

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """(s,) distances of points (p, s), m."""
        distances = np.zeros(points.shape[1])
        for trial, simulated in zip(self.swims.trials, self.swims.simulate(points), strict=True):
            if self.shape_only:
                frames = trial.scored[: simulated.shape_m.shape[-3]]
                error = simulated.shape_m[:, frames] - trial.head.shape_m[trial.scored]
            else:
                error = residuals(trial, simulated, trial.scored)
            good = trial.weight[trial.scored] > 0
            distances += np.nan_to_num(np.linalg.norm(error, axis=-1)[:, good], nan=1.0).mean(axis=1)
        distances /= len(self.swims.trials)
        self._count(points.shape[1])
        return self.consider(points, distances)

    def consider(self, points: np.ndarray, distances: np.ndarray) -> np.ndarray:
        """Takes note of points (p, s) with known distances (s,); returns these with the penalty where it applies."""
        result = distances.copy()
        for i in np.argsort(distances):
            if distances[i] >= self.best_m:
                break
            self.spent_s += self._seconds_from_rest
            if swims_forward(self.swims.twin, points[:5, i][None], self.swims.trials)[0]:
                self.best_m, self.best_point = float(distances[i]), points[:, i].copy()
                self.trace.append((self.spent_s, self.best_m))
                break
            result[i] *= PENALTY
        return result

    def phased(self, coefficients: np.ndarray) -> np.ndarray:
        """(p, s) points: sets of coefficients (s, 5), each with the crank phases that bring the tail in step."""
        twin, trials = self.swims.twin, self.swims.trials
        self._count(len(coefficients))
        phases = [phase_from_harmonic(twin, trial, coefficients, trial.frequency.hz) for trial in trials]
        return np.vstack([coefficients.T, phases])

    def in_step(self, coefficients: np.ndarray) -> np.ndarray:
        """(s,) distances of sets of coefficients (s, 5), each with its own best phases, m."""
        return self(self.phased(coefficients))

    def _count(self, points: int) -> None:
        self.evaluations += points
        self.spent_s += points * self._seconds
