"""A course that is known is found again, with errors that are what they claim."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fitting import MeasuredTrial
from fitting.course import course_of
from tests.fitting.exact_swims import FPS, exact_swims, lasting_noise

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


def test_its_standard_errors_hold_the_truth_as_often_as_they_claim(straight: MeasuredTrial) -> None:
    """Errors that last a tenth of a second; 90 % intervals, 60 draws of three rates.

    On the safe side: errors are thought to last for up to one and a half beats.
    """
    random, clean = np.random.default_rng(5), course_of(turning(straight))
    noise = lasting_noise((60, len(straight.time_s), 3), random, 0.1) * (0.002, 0.002, 0.01)
    inside = []
    for each in noise:
        found = course_of(turning(straight, each))
        inside += [abs(a.value - b.value) < 1.645 * a.se for a, b in zip(found, clean, strict=True)]
    assert FPS == 60.0
    assert 0.85 < np.mean(inside) <= 0.99
