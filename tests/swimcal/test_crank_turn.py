import numpy as np
import pytest

from swimcal.robot import load_robot
from swimcal.runs import CrankTurn, Runs
from swimcal.twin import Twin

HZ = 0.9
COEFFICIENTS = np.array([[0.4, 2.0, 6.0, 4.0, 1.0]])
PULSES = 4096


def angle(time_s: np.ndarray) -> np.ndarray:
    beat = 2 * np.pi * HZ * time_s
    return beat + 0.15 * np.sin(beat) + 0.05 * np.sin(2 * beat + 1)


def speed(time_s: np.ndarray) -> np.ndarray:
    beat = 2 * np.pi * HZ * time_s
    return 2 * np.pi * HZ * (1 + 0.15 * np.cos(beat) + 0.1 * np.cos(2 * beat + 1))


def logged(forward: int = 1) -> CrankTurn:
    """From readings as an encoder and a host give them: in steps, half a millisecond late or early."""
    random = np.random.default_rng(0)
    time_s = np.arange(-1, 8, 0.01) + random.normal(0, 5e-4, 900)
    return CrankTurn.measured(time_s, forward * np.round(angle(time_s) * PULSES / (2 * np.pi)) / PULSES * 2 * np.pi)


def test_the_steps_of_an_encoder_are_smoothed_away() -> None:
    time_s = np.linspace(-0.5, 7.5, 999)
    assert np.abs(logged().speed(time_s) - speed(time_s)).max() < 0.01 * 2 * np.pi * HZ
    assert np.abs(logged().angle(time_s) - (angle(time_s) - angle(np.zeros(1)))).max() < 2e-3


def test_it_turns_on_evenly_beyond_its_ends() -> None:
    turn = logged()
    assert np.diff(turn.angle(np.array([9.0, 10.0, 11.0])), 2) == pytest.approx(0, abs=1e-9)
    assert turn.speed(20.0) == pytest.approx(turn.speed(turn.end_s))


def test_another_clock_moves_and_stretches_it() -> None:
    turn, offset_s, rate = logged(), 0.3, 1.01
    time_s = np.linspace(0, 5, 50)
    expected = turn.angle(offset_s + rate * time_s) - turn.angle(offset_s)
    assert turn.shifted(offset_s, rate).angle(time_s) == pytest.approx(expected)


def test_readings_in_disorder_are_refused() -> None:
    with pytest.raises(ValueError, match="growing times"):
        CrankTurn.measured(np.array([0.0, 2.0, 1.0, 3.0, 4.0]), np.arange(5.0))


def test_the_twin_s_crank_follows_it_next_to_one_that_turns_evenly() -> None:
    twin, turn, time_s = Twin(load_robot()), logged(), np.arange(0, 4, 1 / 60)
    runs = Runs(np.repeat(COEFFICIENTS, 2, axis=0), np.array([HZ, HZ]), np.array([0.4, 0.4]), turns=(turn, None))
    crank = twin.simulate(runs, time_s).crank_rad
    assert np.abs(crank[0] - 0.4 - turn.angle(time_s)).max() < 1e-4
    assert np.abs(crank[1] - 0.4 - 2 * np.pi * HZ * time_s).max() < 0.01


def test_an_even_turn_simulates_like_none_at_all() -> None:
    twin, time_s = Twin(load_robot()), np.arange(0, 3, 1 / 60)
    readings = np.arange(-1, 5, 0.01)
    even = CrankTurn.measured(readings, 2 * np.pi * HZ * readings)
    with_turn = Runs(COEFFICIENTS, np.array([HZ]), np.zeros(1), turns=(even,))
    without = Runs(COEFFICIENTS, np.array([HZ]), np.zeros(1))
    difference = twin.simulate(with_turn, time_s).marker_m - twin.simulate(without, time_s).marker_m
    assert np.abs(difference).max() < 3e-3  # the motor of the robot gives way by some thousandths of a radian


def test_one_turn_for_each_simulation_is_asked_for() -> None:
    with pytest.raises(ValueError, match="turns: found 2"):
        Runs(COEFFICIENTS, np.array([HZ]), np.zeros(1), turns=(None, None))
