"""Strouhal and swimming number take how far the tail swings in the pool, whatever course the fish takes there."""

from __future__ import annotations

import numpy as np
import pytest

from fitting.ebt import simulated_numbers, swim_numbers
from fitting.pool import forward_speed
from fitting.trial import MeasuredTrial
from swimcal.robot import load_robot
from tests.fitting.swims import by_hand
from tests.swimcal.sample import needs_fishsim
from tracking.head_frame import to_head_frame

ROBOT = load_robot()
HZ, SPEED_M_S, EXCURSION_M = 1.0, 0.08, 0.11
TIME_S = np.arange(0.0, 5.0, 1 / 60)
BEAT = 2 * np.pi * HZ * TIME_S
# How far each marker is behind the nose, how far it swings sideways in the pool, and how much later than the nose.
ALONG_M = np.array([0.0, 0.142, 0.40, 0.45, 0.55])
SWING_M = np.array([0.02, 0.004, 0.025, 0.035, EXCURSION_M / 2])
LAG_RAD = np.array([0.0, 0.0, -0.3, 0.0, 0.4])


def swim(heading_rad: float = 0.3, turning: float = 0.0, side: float = 1.0, **changes: object) -> MeasuredTrial:
    """A fish that swims along an arc and beats across it; its head sways and yaws with the beat."""
    heading = heading_rad + turning * TIME_S
    path = np.cumsum(SPEED_M_S / 60 * np.exp(1j * (heading - turning / 120)))
    across = side * SWING_M * np.cos(BEAT[:, None] - LAG_RAD) + 0.004 * np.cos(2 * BEAT[:, None])
    place = path[:, None] + (1j * across - ALONG_M) * np.exp(1j * heading)[:, None]
    return by_hand(np.stack([place.real, place.imag], axis=-1), fps=60.0, speed=SPEED_M_S, **changes)


def test_a_tail_that_swings_by_a_known_width_has_the_numbers_of_that_width() -> None:
    trial = swim()
    found = swim_numbers(trial, ROBOT)
    viscosity = ROBOT.water.viscosity_pa_s / ROBOT.water.density_kg_m3
    assert found.amplitude_m == pytest.approx(EXCURSION_M / 2, rel=1e-6)
    assert found.strouhal == pytest.approx(HZ * EXCURSION_M / SPEED_M_S, rel=1e-6)
    assert found.swimming_number == pytest.approx(np.pi * HZ * EXCURSION_M * ROBOT.length_m / viscosity, rel=1e-6)
    in_head_frame = np.ptp(trial.head.shape_m[:, -1, 1])
    assert in_head_frame > 1.5 * EXCURSION_M  # which is not what the literature calls the excursion


@pytest.mark.parametrize("heading_rad", [0.0, 1.9, 3.1, -2.2])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_swim_that_is_turned_or_mirrored_has_the_same_numbers(heading_rad: float, side: float) -> None:
    assert swim_numbers(swim(heading_rad, side=side), ROBOT) == pytest.approx(swim_numbers(swim(), ROBOT), rel=1e-6)


@pytest.mark.parametrize("turning", [-0.1, 0.07])
def test_an_arc_is_no_excursion(turning: float) -> None:
    assert swim_numbers(swim(turning=turning), ROBOT).amplitude_m == pytest.approx(EXCURSION_M / 2, rel=0.01)


def test_a_simulation_that_moves_as_the_trial_has_its_numbers() -> None:
    trial = swim(turning=0.05)
    head = to_head_frame(trial.position_m, 0, 1)
    weight = np.where(np.arange(5) == 2, 0.0, trial.weight)
    for seen in (trial, trial.seen_as(weight=weight)):
        found = simulated_numbers(seen, head, HZ, ROBOT)
        assert found.amplitude_m == pytest.approx(swim_numbers(trial, ROBOT).amplitude_m, rel=1e-3)
        speed = forward_speed(TIME_S, head, trial.kept, HZ)
        assert found.strouhal == pytest.approx(2 * HZ * found.amplitude_m / speed)


@needs_fishsim
def test_the_public_swims_have_one_strouhal_number_from_three_quarters_of_a_turn_on(
    public: list[MeasuredTrial],
) -> None:
    """By the tracks alone and whatever is held out; the hull's roll, which swings the raised marker, is in it."""
    strouhal = {trial.name: swim_numbers(trial, ROBOT).strouhal for trial in public}
    published = {"f0_50": 2.35, "f0_75": 1.21, "f1_00": 1.02, "f1_25": 1.00, "f1_75": 1.00}
    assert strouhal == pytest.approx(published, abs=0.006)
