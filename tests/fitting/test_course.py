"""A course that is known is found again, with errors that are what they claim."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fitting import MeasuredTrial
from fitting.course import course_of
from tests.fitting.exact_swims import exact_swims

TURNING, SIDEWAYS = 0.06, 0.015


@pytest.fixture(scope="module")
def straight() -> MeasuredTrial:
    """The symmetric twin."""
    return exact_swims(hz=(1.1,), seconds=5.0)[0]


def turning(trial: MeasuredTrial, noise: np.ndarray | float = 0.0) -> MeasuredTrial:
    """The same, turning and slipping steadily, with noise (n, 3) in m, m and rad."""
    head = trial.head
    moved = np.column_stack([head.path_m, head.heading_rad]) + noise
    moved[:, 1] -= SIDEWAYS * trial.time_s
    moved[:, 2] += TURNING * trial.time_s
    return replace(trial, head=replace(head, path_m=moved[:, :2], heading_rad=moved[:, 2]))


def test_a_symmetric_twin_swims_straight(straight: MeasuredTrial) -> None:
    course = course_of(straight)

    assert course.forward.value == pytest.approx(straight.speed, rel=0.01)
    assert abs(course.sideways.value) < 0.001
    assert abs(course.turning.value) < np.radians(0.2)
    assert np.isnan([rate.se for rate in course_of(straight, straight.head)]).all()  # a simulation has no error


def test_a_steady_turn_and_slip_are_found_beside_the_beat(straight: MeasuredTrial) -> None:
    plain, course = course_of(straight), course_of(turning(straight))

    assert course.turning.value - plain.turning.value == pytest.approx(TURNING)
    assert course.sideways.value - plain.sideways.value == pytest.approx(SIDEWAYS)
