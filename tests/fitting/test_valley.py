"""The walk along a valley reaches the lower of two floors beyond a bend and a barrier, and a simplex in its shape goes
along it where one along the coefficients creeps.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fitting.mean_distance import MeanDistance
from fitting.objective import Swims
from fitting.search_space import ROOTS, SearchSpace
from fitting.valley import ELSEWHERE, along_valley
from fitting.valley_simplex import LONGEST, RISE_M, _edges
from synthetic import PLAUSIBLE_COEFFICIENTS
from tests.fitting.exact_swims import PHASES, exact_swims, exact_twin

MOVED, LOWER, UPPER = 4, 1.0, 2.4


class BentValley:
    """A stand-in for a `SearchSpace`: five roots and a phase; the others follow a parabola of the fifth root."""

    size = 6
    low, high = np.append(np.zeros(5), -10.0), np.append(np.full(5, ROOTS[1]), 10.0)
    norm = MeanDistance(np.full(4, 0.25))

    def floor(self, root: float) -> np.ndarray:
        others = 0.8 + 0.2 * (root - 1) ** 2 * np.array([1.0, 0.5, 1.5, 0.8, -1.0])
        return np.insert(others, MOVED, root)

    def errors(self, points: np.ndarray) -> np.ndarray:
        columns = points.reshape(self.size, -1)
        off = columns - np.stack([self.floor(root) for root in columns[MOVED]], axis=1)
        root = columns[MOVED]
        wells = 2e-3 * (root - LOWER) * (root - UPPER) + 2e-4 * root
        return np.vstack([0.05 * np.delete(off, MOVED, axis=0), wells, 0 * wells, 0 * wells])

    def objectives(self, points: np.ndarray) -> np.ndarray:
        return np.array([self.norm.value(column[:, None]) for column in self.errors(points).T])

    def slopes_ahead(self, x: np.ndarray, errors: np.ndarray) -> np.ndarray:
        return (self.errors(x + 1e-6 * np.eye(self.size)) - errors) / 1e-6


def test_the_walk_crosses_the_barrier_to_the_other_floor() -> None:
    space: Any = BentValley()
    lowest, _ = along_valley(space, space.floor(UPPER), MOVED, steps=16)
    roots = [point[MOVED] for point in along_valley(space, space.floor(UPPER), MOVED, steps=8)]

    assert np.diff(np.sort([*roots, UPPER])).min() > ELSEWHERE
    assert lowest[MOVED] == pytest.approx(LOWER, abs=0.2)
    np.testing.assert_allclose(lowest, space.floor(lowest[MOVED]), atol=0.01)


BUDGET_S = 600.0
START = np.append(np.array(PLAUSIBLE_COEFFICIENTS) * [1.1, 0.95, 1.1, 0.97, 1.3], PHASES[:2] + 0.02)


@pytest.fixture(scope="module")
def swims() -> Swims:
    return Swims(exact_twin(), exact_swims(hz=(0.7, 1.2), seconds=3.5))


def test_along_edges_not_cut_short_the_objective_rises_alike(swims: Swims) -> None:
    """By what they are made for, from its lowest point; the longest ones leave the range where curvature tells."""
    space = SearchSpace(swims)
    lowest = np.append(np.sqrt(PLAUSIBLE_COEFFICIENTS), PHASES[:2])
    edges = _edges(space, lowest)
    rises = space.objectives(lowest[:, None] + edges) - space.objectives(lowest[:, None])

    assert np.linalg.norm(edges, axis=0).max() <= LONGEST * (1 + 1e-9)
    np.testing.assert_allclose(rises[3:], RISE_M, rtol=0.4)
