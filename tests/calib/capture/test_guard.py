import pytest

from calib.capture import registers
from calib.capture.bus import MotorFault
from calib.capture.motor import Guard, Limits, Reading
from calib.capture.registers import Telemetry

GOAL = registers.velocity_units(0.6)


def reading(k: int, *, velocity: int = GOAL, ampere: float = 0.5, celsius: int = 30, late_ms: int = 0) -> Reading:
    """The kth of readings every 10 ms; the tick wraps on the way."""
    tick = (32000 + 10 * k - late_ms) % registers.TICKS
    return Reading(5 + k / 100, 0.001, Telemetry(tick, round(ampere / registers.AMPERE), velocity, 0, 120, celsius))


def test_a_motor_that_does_what_it_should_is_left_alone() -> None:
    guard = Guard(Limits())
    guard.command(GOAL, 5.0)
    for k in range(300):
        guard.check(reading(k, velocity=min(GOAL, 3 * k)))


@pytest.mark.parametrize("sign", [1, -1])
def test_a_current_too_high_is_borne_for_its_patience_only(sign: int) -> None:
    guard = Guard(Limits(current_a=2.0))
    for k in range(40):
        guard.check(reading(k, ampere=3.0 * sign))
    guard.check(reading(40))  # a peak: it starts anew
    for k in range(41, 91):
        guard.check(reading(k, ampere=3.0 * sign))
    with pytest.raises(MotorFault, match=r"current is too high; found: 3\.00 A for 0\.5 s; expected: at most 2 A"):
        guard.check(reading(91, ampere=3.0 * sign))


@pytest.mark.parametrize("velocity", [0, GOAL // 3, -GOAL])
def test_a_motor_that_does_not_follow_is_stopped(velocity: int) -> None:
    guard = Guard(Limits())
    guard.command(GOAL, 5.0)
    for k in range(150):  # it has its time to get there
        guard.check(reading(k, velocity=velocity))
    with pytest.raises(MotorFault, match=r"does not follow; found: .* expected: near 0\.60"):
        guard.check(reading(160, velocity=velocity))


@pytest.mark.parametrize("late_ms", [300, -300])
def test_a_motor_whose_clock_jumps_is_stopped(late_ms: int) -> None:
    guard = Guard(Limits())
    for k in range(100):
        guard.check(reading(k))
    with pytest.raises(MotorFault, match="clock jumped by"):
        guard.check(reading(100, late_ms=late_ms))
