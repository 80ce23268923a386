from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.reality.mechanisms.drive import DriveRatioError, MotorSpeedRipple, MotorSpeedSag, MotorStartDelay
from benchmarks.reality.tendons import Turn

STEP_S = 0.001
TOLD = 2 * np.pi


def even(time_s, hz=1.0):
    return Turn(2 * np.pi * hz * time_s, np.full_like(time_s, 2 * np.pi * hz))


def turned(mechanism, torque, seconds, hz=1.0):
    """(k,) angle and speed of a crank alone, under a torque (N m) that is a function of time."""
    state, angle, speed = None, [], []
    for k in range(round(seconds / STEP_S)):
        time_s = np.array([[k * STEP_S]])
        now = SimpleNamespace(
            time_s=time_s,
            turn=even(time_s, hz),
            pull=SimpleNamespace(crank_torque_n_m=np.array([[torque(k * STEP_S)]])),
        )
        state = mechanism.start(now) if state is None else state
        now.turn = mechanism.turn(time_s, even(time_s, hz), state)
        angle.append(now.turn.angle_rad[0, 0])
        speed.append(now.turn.speed_rad_s[0, 0])
        state = mechanism.advance(now, state, STEP_S)
    return np.array(angle), np.array(speed)


def test_a_wrong_ratio_turns_further_in_proportion():
    time_s = np.linspace(-1, 3, 401)[:, None]
    begun = even(time_s[:1]).angle_rad
    plain = DriveRatioError(0.02, 0.0).turn(time_s, even(time_s), begun)
    assert (plain.angle_rad - begun)[:, 0] == pytest.approx(1.02 * TOLD * (time_s[:, 0] + 1))
    uneven = DriveRatioError(0.02, 0.01).turn(time_s, even(time_s), begun)
    assert np.abs(uneven.angle_rad - plain.angle_rad).max() == pytest.approx(0.01, rel=1e-3)
    slope = np.gradient(uneven.angle_rad[:, 0], time_s[:, 0])
    assert uneven.speed_rad_s[1:-1, 0] == pytest.approx(slope[1:-1], rel=1e-3)


@pytest.mark.long
def test_a_loaded_motor_settles_at_its_limit():
    _, speed = turned(MotorSpeedSag(0.03, 2.0, 0.5), lambda _: 0.45, 40.0)
    assert speed[0] == TOLD
    assert speed[-1] == pytest.approx(TOLD / np.sqrt(1 + 2 * 0.03 * 1.5), rel=1e-3)  # loaded as usual, warm
    assert speed[2000] > speed[10_000] > speed[-1]


def test_the_share_of_speed_that_is_lost_grows_with_a_power_of_the_speed():
    lost = [
        1 - turned(MotorSpeedSag(0.001, 3.0, 0.0), lambda _: -0.45, 5.0, hz)[1][-1] / (TOLD * hz) for hz in (0.5, 1)
    ]
    assert lost[1] == pytest.approx(0.001, rel=0.02)
    assert lost[1] / lost[0] == pytest.approx(8.0, rel=0.02)


def test_the_angle_of_a_sagging_crank_is_the_integral_of_its_speed():
    angle, speed = turned(MotorSpeedSag(0.3, 2.5, 0.5), lambda t: 0.6 * np.sin(9 * t), 3.0)
    assert angle[-1] == pytest.approx(speed[:-1].sum() * STEP_S, rel=1e-9)


@pytest.mark.long
def test_a_soft_loop_answers_a_periodic_torque_as_a_second_order_system():
    """|rate| = torque / |gain + i w J + gain / (2 s i w)|."""
    gain, w = 2.0, 2 * TOLD
    _, speed = turned(MotorSpeedRipple(gain, 1.0), lambda t: 0.6 * np.cos(w * t), 20.0)
    steady = speed[-2000:] - TOLD
    amplitude = 0.6 / abs(gain + 1j * w * 0.01 + gain / (2j * w))
    assert np.sqrt(2) * steady.std() == pytest.approx(amplitude, rel=0.01)
    assert abs(steady.mean()) < 1e-3


def test_a_gear_passes_less_of_a_torque_that_drives():
    def droop(torque):
        return np.abs(turned(MotorSpeedRipple(2.0, 0.4), lambda _: torque, 0.1)[1] - TOLD).max()

    assert droop(-0.5) == pytest.approx(0.4 * droop(0.5), rel=1e-9)


def test_a_late_motor_rests_spins_up_and_stays_late():
    mechanism = MotorStartDelay(rest_s=0.3, spin_up_s=0.1)
    time_s = np.arange(-2.0, 3.0, 0.001)[:, None]
    turn = mechanism.turn(time_s, even(time_s), np.zeros((len(time_s), 0)))
    angle, speed, t = turn.angle_rad[:, 0], turn.speed_rad_s[:, 0], time_s[:, 0]
    assert angle[t < -1.5] == pytest.approx(TOLD * t[t < -1.5], abs=1e-5)
    assert angle[(t >= 0) & (t < 0.3)] == pytest.approx(0.0, abs=1e-12)
    assert angle[-1] == pytest.approx(TOLD * (t[-1] - 0.4))
    assert speed[np.argmin(np.abs(t - 0.4))] == pytest.approx(TOLD * (1 - np.exp(-1)), rel=1e-6)
    assert np.gradient(angle, t) == pytest.approx(speed, abs=0.05 * TOLD)
    assert (speed > -1e-9).all()
