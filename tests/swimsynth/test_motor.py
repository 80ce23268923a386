import numpy as np
import pytest

from calib.capture.trials import TrialPlan
from swimsynth.disturbances import COMMAND_DELAY_S, MotorDrive, SyntheticMotor, drive, schedule
from tests.swimsynth.plans import MOTOR

COMMANDED_HZ, REACHED_HZ, PHASE_RAD = 0.9, 0.88, 2.0
SMOOTH = MOTOR.model_copy(update={"ripple": (0.0, 0.0)})


def driven(motor: SyntheticMotor = MOTOR, seed: int = 0) -> MotorDrive:
    return drive(motor, COMMANDED_HZ, REACHED_HZ, PHASE_RAD, np.random.default_rng(seed))


@pytest.mark.parametrize(("hz", "seconds"), [(0.6, 6.0), (1.1, 20.0)])
def test_the_schedule_is_that_of_a_capture(hz: float, seconds: float) -> None:
    assert list(schedule(hz, seconds)) == list(TrialPlan("x", hz, seconds).steps())


def test_the_schedule_begins_and_ends_when_it_should() -> None:
    made = driven()

    assert float(MOTOR.video(made.time_s[:1])[0]) == pytest.approx(MOTOR.starts_s, abs=1e-6)
    assert float(MOTOR.video(np.array([made.end_s]))[0]) == pytest.approx(MOTOR.ends_s, abs=1e-6)


def test_commands_come_in_their_order_and_a_little_late() -> None:
    made = driven()
    steps = schedule(COMMANDED_HZ, MOTOR.drive_s)
    due_s = MOTOR.clock(MOTOR.starts_s) + np.cumsum([0.0, *(step.seconds for step in steps[:-1])])
    late_s = made.commands.time_s - due_s

    assert made.commands.part == tuple(step.part for step in steps)
    assert (late_s > 0).all()
    assert late_s.mean() == pytest.approx(COMMAND_DELAY_S, rel=0.5)


def test_the_drive_reaches_its_speed_by_a_ramp_and_holds_it() -> None:
    made = driven(SMOOTH)
    commanded_s = made.commands.time_s[made.commands.part.index("drive")]
    start_s, end_s = made.steady_s
    ramp_s = REACHED_HZ / SMOOTH.acceleration_turns_per_s2

    def hz(time_s: float) -> float:
        return float(np.interp(time_s, made.time_s, made.speed_rad_s)) / (2 * np.pi)

    assert hz(commanded_s + ramp_s / 2) == pytest.approx(REACHED_HZ / 2, rel=0.02)
    assert hz(commanded_s + ramp_s + 0.01) == pytest.approx(REACHED_HZ)
    assert made.turn.mean_hz(start_s, end_s) == pytest.approx(REACHED_HZ, rel=1e-6)
    assert made.turn.speed(np.array([start_s, end_s - 0.1])) == pytest.approx(2 * np.pi * REACHED_HZ, rel=1e-6)


def test_the_load_ripples_the_speed_once_and_twice_a_turn_and_not_its_mean() -> None:
    motor = SyntheticMotor(drive_s=9.0, ripple=(0.02, 0.05))
    made = driven(motor)
    start_s, end_s = made.steady_s
    turns = np.floor((end_s - start_s) * REACHED_HZ)
    time_s = start_s + np.arange(2000) * turns / REACHED_HZ / 2000
    speed = made.turn.speed(time_s) / (2 * np.pi * REACHED_HZ)
    swing = 2 * np.abs(np.fft.rfft(speed)) / len(speed)

    assert speed.mean() == pytest.approx(1.0, abs=1e-4)
    assert swing[int(turns)] == pytest.approx(0.02, rel=0.02)
    assert swing[2 * int(turns)] == pytest.approx(0.05, rel=0.02)
    np.testing.assert_allclose(np.interp(time_s, made.time_s, made.speed_rad_s), made.turn.speed(time_s), rtol=1e-3)


def test_the_codes_bring_the_crank_back_and_the_rests_hold_it() -> None:
    made = driven(SMOOTH)
    drive_at = made.commands.part.index("drive")
    before_s, after_s = made.commands.time_s[[drive_at, drive_at + 1]]

    assert abs(made.turn.angle(before_s) - made.turn.angle(made.time_s[0])) < 0.1
    for time_s in (made.time_s[0] - 5.0, made.time_s[0] + 0.3, before_s - 0.1, after_s + 0.9, made.end_s + 5.0):
        assert abs(float(made.turn.speed(time_s))) < 1e-6
