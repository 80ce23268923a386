"""Descents begin apart from one another, at forward swimmers where there are enough of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fitting.search_space import SearchSpace


@dataclass
class Forward:
    """Stands for a search space in which points with a first root below 1.5 swim forward; counts what it is asked."""

    asked: int = 0

    def swims_forward(self, points: np.ndarray) -> np.ndarray:
        self.asked += points.shape[1]
        return np.asarray(points[0] < 1.5)


def places(*roots: float) -> np.ndarray:
    """(6, s) points with those first roots, and a phase that is another each time."""
    points = np.ones((6, len(roots)))
    points[0], points[5] = roots, np.arange(len(roots))
    return points


def begun(space: Forward, points: np.ndarray, wanted: int) -> list[float]:
    return [float(point[0]) for point in SearchSpace.promising(space, points, wanted, 0.2)]  # type: ignore[arg-type]


def test_the_best_come_first_and_keep_their_distance() -> None:
    assert begun(Forward(), places(1.0, 1.1, 1.3, 0.7, 0.4), 3) == [1.0, 1.3, 0.7]


def test_backward_swimmers_are_taken_only_where_too_few_swim_forward() -> None:
    points = places(2.0, 1.0, 2.5, 1.05, 0.5)
    assert begun(Forward(), points, 2) == [1.0, 0.5]
    assert begun(Forward(), points, 4) == [1.0, 0.5, 2.0, 2.5]


def test_no_more_are_swum_from_rest_than_needed() -> None:
    space = Forward()
    SearchSpace.promising(space, places(*np.linspace(0.0, 1.4, 100)), 2, 0.01)  # type: ignore[arg-type]
    assert space.asked == 2
