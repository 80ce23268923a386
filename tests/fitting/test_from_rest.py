"""Twins that swim backward from rest are reported apart from those that swim forward, as the robot does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fitting.phase import speed_from_rest, swims_forward
from fitting.trial import MeasuredTrial
from swimcal.mjcf import PUBLISHED_COEFFICIENTS
from swimcal.robot import load_robot
from swimcal.twin import Twin

FORWARD = (0.43, 6.5, 9.97, 4.14, 7.56)
BACKWARD = (0.0, 3.46, 10.0, 1.095, 0.0)
"""As close to the public tracks as the other, when started at the measured speed."""


def test_known_twins_are_reported_apart_at_low_frequency(trials: dict[str, MeasuredTrial]) -> None:
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
