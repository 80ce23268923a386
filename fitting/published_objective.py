"""The published objective as every search sees it: mean marker distance, what it cost so far, and the best so far.

A point counts as a new best only if its twin swims forward from rest (see `fitting.from_rest`), for all searches
alike; a point that would win but swims backward is handed back with a penalty.
"""

import numpy as np

from fitting.coefficients import Progress
from fitting.from_rest import seconds_from_rest, swims_forward
from fitting.objective import COEFFICIENT_BOUNDS, Swims
from fitting.phase import phase_from_harmonic

FREE_TURNS_RAD = 100.0  # phases are free; optimisers ask for finite bounds
PENALTY = 1.5  # factor on the distance of what swims backward


class BudgetSpent(Exception):
    """Ends an optimiser that has no other way to stop."""


class PublishedObjective:
    """Mean marker distance over the fit trials, as a function of coefficients and phases.

    Args:
        swims: the fit trials, the twin, and how they are compared.
        budget_s: simulated seconds it is meant for, which `progress` is told the share of.
        progress: called with that share and the best distance so far, m.

    Attributes:
        spent_s: seconds simulated so far, the checks from rest included.
        evaluations: points evaluated so far.
        best_point: (p,) the best so far that swims forward; `best_m` its distance, m.
        trace: (spent_s, best_m) at every new best.
    """

    def __init__(self, swims: Swims, budget_s: float, progress: Progress | None = None) -> None:
        self.swims = swims
        self._budget_s, self._progress = budget_s, progress
        free = np.full(len(swims.trials), FREE_TURNS_RAD)
        self.bounds = (
            np.append(np.full(5, COEFFICIENT_BOUNDS[0]), -free),
            np.append(np.full(5, COEFFICIENT_BOUNDS[1]), free),
        )
        self.spent_s, self.evaluations = 0.0, 0
        self.best_m, self.best_point = np.inf, np.zeros(len(free) + 5)
        self.trace: list[tuple[float, float]] = []
        self._bests: list[np.ndarray] = []
        self._seconds = sum(float(t.time_s[t.scored][-1]) for t in swims.trials)
        self._seconds_from_rest = seconds_from_rest(swims.trials)

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """(s,) distances of points (p, s), m."""
        distances = self.swims.mean_distance(points)
        self._count(points.shape[1])
        result = self.consider(points, distances)
        if self._progress is not None:
            self._progress(min(self.spent_s / self._budget_s, 1.0), self.best_m)
        return result

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
                self._bests.append(self.best_point)
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

    @property
    def softened_m(self) -> np.ndarray:
        """(i,) the softened objective at every new best, m: simulated once more, which no budget pays for."""
        errors = self.swims.errors(np.stack(self._bests, axis=1))
        return np.array([float(self.swims.norm.value(column[:, None])) for column in errors.T])

    def _count(self, points: int) -> None:
        self.evaluations += points
        self.spent_s += points * self._seconds
