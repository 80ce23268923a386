from pathlib import Path

import numpy as np
import pytest

from calib.capture.logs import COMMANDS_HEADER, MOTOR_HEADER
from swimcal.motor_log import SPEED_RAD_S, MotorLog, load_commands, load_motor
from swimsynth.disturbances import MotorDrive, drive
from swimsynth.simulate import PULSE_RAD, read_motor, reading_times, save_commands, save_motor_log
from tests.swimsynth.plans import MOTOR


@pytest.fixture(scope="module")
def driven() -> MotorDrive:
    return drive(MOTOR, 0.9, 0.88, 2.0, np.random.default_rng(0))


@pytest.fixture(scope="module")
def log(driven: MotorDrive) -> MotorLog:
    random = np.random.default_rng(1)
    time_s = reading_times(MOTOR, driven, random)
    return read_motor(driven, time_s, driven.turn.angle(time_s), random)


def test_it_is_read_every_ten_milliseconds_unevenly(log: MotorLog, driven: MotorDrive) -> None:
    apart_s = np.diff(log.time_s)

    assert (apart_s > 0).all()
    assert apart_s.mean() == pytest.approx(0.01, rel=1e-3)
    assert 2e-4 < apart_s.std() < 2e-3
    assert 0 <= log.time_s[0] - driven.commands.time_s[0] < 0.01
    assert driven.end_s - log.time_s[-1] < 0.02


def test_the_position_is_that_of_the_crank_to_a_step_of_the_encoder(log: MotorLog, driven: MotorDrive) -> None:
    apart = log.position_rad - driven.turn.angle(log.time_s)

    assert np.ptp(apart) <= PULSE_RAD + 1e-9
    pulses = log.position_rad / PULSE_RAD
    np.testing.assert_allclose(pulses, np.round(pulses), atol=1e-6)


def test_the_log_is_written_as_a_capture_writes_it(log: MotorLog, tmp_path: Path) -> None:
    save_motor_log(tmp_path / "dry.motor.csv", log)
    again = load_motor(tmp_path / "dry.motor.csv")

    assert (tmp_path / "dry.motor.csv").read_text().splitlines()[0] == MOTOR_HEADER
    assert again.flags == ()
    np.testing.assert_allclose(again.time_s, log.time_s, atol=6e-7)
    np.testing.assert_allclose(again.position_rad, log.position_rad, atol=6e-7)
    np.testing.assert_allclose(again.velocity_rad_s, log.velocity_rad_s, atol=6e-6)
    np.testing.assert_allclose(again.current_a, log.current_a, atol=6e-5)


def test_the_commands_are_written_as_a_capture_writes_them(driven: MotorDrive, tmp_path: Path) -> None:
    save_commands(tmp_path / "dry.commands.csv", driven.commands)
    again = load_commands(tmp_path / "dry.commands.csv")

    assert (tmp_path / "dry.commands.csv").read_text().splitlines()[0] == COMMANDS_HEADER
    assert again.part == driven.commands.part
    np.testing.assert_allclose(again.time_s, driven.commands.time_s, atol=6e-7)
    np.testing.assert_allclose(again.velocity_rad_s, driven.commands.velocity_rad_s, atol=SPEED_RAD_S / 2 + 1e-5)
