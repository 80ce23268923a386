"""The published objective as every search sees it: mean marker distance, what it cost so far, and the best so far.

A point counts as a new best only if its twin swims forward from rest (see `fitting.from_rest`), for all searches
alike; a point that would win but swims backward is handed back with a penalty.
"""

from collections.abc import Callable

import nlopt
import numpy as np

from fitting.coefficients import Progress
from fitting.objective import Swims
from fitting.search_space import SearchSpace, parameters

PENALTY = 1.5  # factor on the distance of what swims backward


class PublishedObjective:
    """Mean marker distance over the fit trials, as a function of coefficients and phases.

    Args:
        swims: the fit trials, the twin, and how they are compared.
        budget_s: simulated seconds it is meant for, which `progress` is told the share of.
        progress: called with that share and the best distance so far, m.

    Attributes:
        space: the same swims over roots and phases; it counts what is simulated.
        bounds: (p,) of coefficients and phases, lower and upper.
        best_point: (p,) the best so far that swims forward; `best_m` its distance, m.
        trace: (spent_s, best_m) at every new best.
    """

    def __init__(self, swims: Swims, budget_s: float, progress: Progress | None = None) -> None:
        self.swims, self.space = swims, SearchSpace(swims)
        self._budget_s, self._progress = budget_s, progress
        self.bounds = parameters(self.space.low), parameters(self.space.high)
        self.best_m, self.best_point = np.inf, np.zeros(self.space.size)
        self.trace: list[tuple[float, float]] = []
        self._bests: list[np.ndarray] = []

    @property
    def spent_s(self) -> float:
        """Seconds simulated so far, the checks from rest included."""
        return self.space.spent_s

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """(s,) distances of points (p, s), m."""
        distances = self.swims.mean_distance(points)
        self.space.count(points.shape[1])
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
            if self.space.go_forward(points[:5, i][None])[0]:
                self.best_m, self.best_point = float(distances[i]), points[:, i].copy()
                self.trace.append((self.spent_s, self.best_m))
                self._bests.append(self.best_point)
                break
            result[i] *= PENALTY
        return result

    def phased(self, coefficients: np.ndarray) -> np.ndarray:
        """(p, s) points: sets of coefficients (s, 5), each with the crank phases that bring the tail in step."""
        return np.vstack([coefficients.T, self.space.phases_in_step(coefficients)])

    def minimised(
        self, optimiser: nlopt.opt, start: np.ndarray, point: Callable[[np.ndarray], np.ndarray], budget_s: float
    ) -> bool:
        """Spends the rest of a budget of simulated seconds on an optimiser.

        Whether it ended by itself, because it had come close enough.

        Args:
            optimiser: with its bounds, steps and tolerances.
            start: (q,) where it begins.
            point: (p,) of each place (q,) that it tries.
            budget_s: spent in all, this objective's earlier evaluations included.
        """

        def value(place: np.ndarray, _gradient: np.ndarray) -> float:
            if self.spent_s >= budget_s:
                raise nlopt.ForcedStop
            return float(self(point(place)[:, None])[0])

        optimiser.set_min_objective(value)
        try:
            optimiser.optimize(start)
        except nlopt.ForcedStop:
            return False
        return bool(optimiser.last_optimize_result() == nlopt.XTOL_REACHED)

    @property
    def softened_m(self) -> np.ndarray:
        """(i,) the softened objective at every new best, m: simulated once more, which no budget pays for."""
        errors = self.swims.errors(np.stack(self._bests, axis=1))
        return np.array([float(self.swims.norm.value(column[:, None])) for column in errors.T])
