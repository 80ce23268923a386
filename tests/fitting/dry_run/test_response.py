"""The table of the tail's motion in air holds what a simulation would give, to well under 0.2 mm."""

from __future__ import annotations

import numpy as np
import pytest

from fitting.dry_run import DryResponse, EvenTurn, simulate_response, simulate_turns, with_arm
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.errors import NotEnoughData
from tests.fitting.dry_run.runs import ROBOT, clean_run, shared_response


def farthest_mm(one: np.ndarray, other: np.ndarray) -> float:
    return 1e3 * float(np.abs(one - other).max())


@pytest.mark.parametrize("arm_mm", [29.9, 35.3, 38.2, 40.0, 41.2])
def test_between_arms_and_speeds_it_is_what_a_simulation_gives(arm_mm: float) -> None:
    response, hz = shared_response(), np.array([0.52, 0.7, 1.13, 1.4])
    direct = simulate_turns(with_arm(ROBOT, arm_mm / 1e3), FISHSIM_MARKERS, hz)

    for i, speed in enumerate(hz):
        turn = response.turn(arm_mm / 1e3, speed, 0)
        assert farthest_mm(turn.marker_m, direct.marker_m[i]) < 0.16
        np.testing.assert_allclose(turn.lead_rad, direct.lead_rad[i], atol=1e-4)


def test_a_whole_run_of_a_finer_step_is_read_off_one_turn() -> None:
    time_s, marker_m, hz = clean_run(0.0382, 1.19, 4.0)
    turn = shared_response().turn(0.0382, hz, 0)
    read = turn.at(4.0 - float(turn.lead_rad[0]) + 2 * np.pi * hz * time_s)

    assert farthest_mm(read, marker_m[..., 0] + 1j * marker_m[..., 1]) < 0.3  # a tenth of a degree, mostly


def test_a_robot_that_wants_a_shorter_step_gets_it_in_air_too() -> None:
    hz = np.array([1.2])
    plain, slow, fine = (
        simulate_turns(ROBOT.model_copy(update={"time_step_s": step_s}), FISHSIM_MARKERS, hz).marker_m
        for step_s in (ROBOT.time_step_s, 0.009, 0.0005)
    )
    assert (slow == plain).all()
    assert 0 < farthest_mm(fine, plain) < 0.1


def test_the_same_turn_is_the_same_to_the_last_bit() -> None:
    turns = [shared_response().turn(0.0382, 0.87, 0).marker_m.tobytes() for _ in range(20)]

    assert len(set(turns)) == 1


def test_the_lead_tells_the_crank_from_the_even_turn() -> None:
    angle = np.linspace(0, 2 * np.pi, 180, endpoint=False)
    turn = EvenTurn(np.exp(1j * angle)[:, None], 0.1 * np.sin(angle))

    assert turn.crank_rad(np.pi / 2) == pytest.approx(np.pi / 2 + 0.1)
    assert turn.crank_rad(2 * np.pi + 0.3) == pytest.approx(0.3 + 0.1 * np.sin(0.3), abs=1e-6)


def made(arms: int, jump_after: int | None) -> DryResponse:
    """Tails that swing as far as their arm, and much further after a snap."""
    arm_m = np.linspace(0.03, 0.05, arms)
    swing = np.where(np.arange(arms) > (arms if jump_after is None else jump_after), 0.3, 0.0) + arm_m
    wave = np.sin(np.linspace(0, 2 * np.pi, 180, endpoint=False))
    marker_m = 1j * swing[:, None, None, None] * np.ones((1, 3, 1, 1)) * wave[None, None, :, None]
    return DryResponse(("caudal_fin",), arm_m, np.array([0.5, 1.0, 1.5]), marker_m, np.zeros((arms, 3, 180)))


def test_nothing_is_interpolated_across_a_snap() -> None:
    assert made(12, None).branches == (slice(0, 12),)
    assert made(12, 6).branches == (slice(0, 7), slice(7, 12))
    assert made(12, 9).branches == (slice(0, 10),)  # two arms are no branch

    two = made(12, 6)
    assert two.branch_at(0.031) == 0
    assert two.branch_at(0.049) == 1
    assert two.turn(0.033, 0.7, 0).marker_m.imag.max() == pytest.approx(0.033)


def test_a_robot_without_a_smooth_motion_is_refused() -> None:
    with pytest.raises(NotEnoughData, match=r"no smooth motion .* from 0.039 to 0.04 m.*crank.arm_m = 0.0395"):
        simulate_response(ROBOT, ("nose", "caudal_fin"), np.array([0.039, 0.0395, 0.04]), (0.5, 0.6))
