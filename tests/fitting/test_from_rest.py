"""Twins that swim backward from rest are reported apart from those that swim forward, as the robot does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fitting.phase import speed_from_rest, swims_forward
from fitting.trial import MeasuredTrial
from swimcal.mjcf import COEFFICIENT_BOUNDS, PUBLISHED_COEFFICIENTS
from swimcal.robot import load_robot
from swimcal.twin import Twin
from swimsynth.plan import PLAUSIBLE_COEFFICIENTS, SPEEDS_HZ
from tests.cases import later

FORWARD = (0.43, 6.5, 9.97, 4.14, 7.56)
BACKWARD = (0.0, 3.46, 10.0, 1.095, 0.0)
"""As close to the public tracks as the other, when started at the measured speed."""

TWINS = 96


@pytest.fixture(scope="module")
def twin() -> Twin:
    return Twin(load_robot(), ("nose", "neck"))


def trials_at(like: MeasuredTrial, *frequency_hz: float) -> tuple[MeasuredTrial, ...]:
    return tuple(replace(like, frequency=replace(like.frequency, hz=hz)) for hz in frequency_hz)


def test_known_twins_are_reported_apart_at_low_frequency(trials: dict[str, MeasuredTrial], twin: Twin) -> None:
    like_public = trials_at(trials["slow"], 0.75, 1.31)

    assert swims_forward(twin, np.array([FORWARD, BACKWARD]), like_public).tolist() == [True, False]
    speeds = speed_from_rest(twin, np.array([FORWARD, BACKWARD]), np.array([0.4, 1.3]))

    assert (speeds[0] > 0.01).all()
    assert speeds[1, 0] < 0


def test_a_robot_that_was_seen_swimming_backward_may_do_so(trials: dict[str, MeasuredTrial], twin: Twin) -> None:
    backward = (replace(trials["slow"], speed=-0.02), trials["fast"])

    assert swims_forward(twin, np.array([BACKWARD, PUBLISHED_COEFFICIENTS]), backward).all()


@pytest.mark.long
@pytest.mark.parametrize("slowest_hz", [0.4, *later(0.3, 0.75)])
def test_no_twin_is_refused_that_swims_forward_from_some_angle_of_the_crank(
    slowest_hz: float, trials: dict[str, MeasuredTrial], twin: Twin
) -> None:
    """Nobody knows at which angle the robot's crank set off: 12 % of such twins were once refused."""
    random = np.random.default_rng(7)
    drawn, phase_rad = random.uniform(*COEFFICIENT_BOUNDS, (TWINS, 5)), random.uniform(0.0, 2 * np.pi, TWINS)
    with np.errstate(invalid="ignore"):
        swam = (speed_from_rest(twin, drawn, np.array([slowest_hz, 1.3]), phase_rad) > 0.02).all(axis=1)
    admitted = swims_forward(twin, drawn[swam], trials_at(trials["slow"], slowest_hz, 1.3))

    assert swam.sum() > TWINS / 20
    assert admitted.mean() > 0.98


def test_the_truth_of_synthetic_sessions_is_not_refused(trials: dict[str, MeasuredTrial], twin: Twin) -> None:
    for slowest_hz in SPEEDS_HZ:
        assert swims_forward(twin, np.array([PLAUSIBLE_COEFFICIENTS]), trials_at(trials["slow"], slowest_hz)).all()
