"""Descents begin apart from one another, at swimmers that swim forward from rest as the robot does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fitting import MeasuredTrial
from fitting.from_rest import speed_from_rest, swims_forward
from fitting.search_space import SearchSpace
from swimmer import PUBLISHED_COEFFICIENTS, Twin, load_robot


class Forward:
    """Stands for a search space in which points with a first root below 1.5 swim forward."""

    def swims_forward(self, points: np.ndarray) -> np.ndarray:
        return np.asarray(points[0] < 1.5)


def places(*roots: float) -> np.ndarray:
    """(6, s) points with those first roots, and a phase that is another each time."""
    points = np.ones((6, len(roots)))
    points[0], points[5] = roots, np.arange(len(roots))
    return points


def begun(points: np.ndarray, wanted: int) -> list[float]:
    return [float(point[0]) for point in SearchSpace.promising(Forward(), points, wanted, 0.2)]  # type: ignore[arg-type]


def test_the_best_come_first_and_keep_their_distance() -> None:
    assert begun(places(1.0, 1.1, 1.3, 0.7, 0.4), 3) == [1.0, 1.3, 0.7]


def test_backward_swimmers_are_taken_only_where_too_few_swim_forward() -> None:
    points = places(2.0, 1.0, 2.5, 1.05, 0.5)
    assert begun(points, 2) == [1.0, 0.5]
    assert begun(points, 4) == [1.0, 0.5, 2.0, 2.5]


FORWARD = (0.43, 6.5, 9.97, 4.14, 7.56)
BACKWARD = (0.0, 3.46, 10.0, 1.095, 0.0)
"""As close to the public tracks as the other, when started at the measured speed."""


def test_known_twins_are_told_apart_at_low_frequency(trials: dict[str, MeasuredTrial]) -> None:
    twin = Twin(load_robot(), ("nose", "neck"))
    like_public = tuple(
        replace(trials["slow"], frequency=replace(trials["slow"].frequency, hz=hz)) for hz in (0.75, 1.31)
    )

    assert swims_forward(twin, np.array([FORWARD, BACKWARD]), like_public).tolist() == [True, False]
    speeds = speed_from_rest(twin, np.array([FORWARD, BACKWARD]), np.array([0.4, 1.3]))

    assert (speeds[0] > 0.01).all()
    assert speeds[1, 0] < 0


def test_a_robot_that_was_seen_swimming_backward_may_do_so(trials: dict[str, MeasuredTrial]) -> None:
    twin = Twin(load_robot(), ("nose", "neck"))
    backward = (replace(trials["slow"], speed=-0.02), trials["fast"])

    assert swims_forward(twin, np.array([BACKWARD, PUBLISHED_COEFFICIENTS]), backward).all()
