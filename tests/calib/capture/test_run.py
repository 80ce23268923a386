import csv
import math
import operator
import os
import signal
from pathlib import Path

import numpy as np
import pytest

from calib.capture import trials
from calib.capture.bus import Interrupted, MotorFault, UserError
from calib.capture.logs import COMMANDS_HEADER
from calib.capture.trials import START_CODE
from swimcal.motor_log import load_motor
from swimcal.robot import load_robot
from swimcal.session import load_session
from tests.calib.capture.virtual import bench
from tests.calib.motor.faults import INPUT_VOLTAGE, OVERLOAD, Fault, Faults, FaultyEmulator, power_cycle, raise_error


def logged(out: Path, name: str = "f0_60") -> Path:
    return out / "trials" / f"{name}.motor.csv"


def test_a_capture_is_a_session_with_its_speeds_driven_and_logged(tmp_path: Path) -> None:
    one, out = bench(), tmp_path / "pool"
    results = one.capture(out, 0.6, 0.8, 0.6, seconds=4.0, coded=True)
    session = load_session(out, load_robot)
    assert [(t.name, t.commanded_hz) for t in session.trials] == [("f0_60", 0.6), ("f0_80", 0.8), ("f0_60_2", 0.6)]
    for trial, result in zip(session.trials, results, strict=True):
        assert trial.motor is not None
        assert trial.commanded_hz is not None
        log = load_motor(trial.motor)
        assert np.diff(log.time_s).max() <= 0.02  # 50 Hz or more, throughout
        assert result.rate_hz == pytest.approx(100, rel=0.02)
        assert result.measured_hz == pytest.approx(trial.commanded_hz, abs=0.229 / 60)  # a unit of the goal velocity
        turned = np.gradient(log.position_rad, log.time_s)
        assert np.median(np.abs(turned - log.velocity_rad_s)) < 0.1
        assert np.ptp(log.voltage_v) < 0.5
        assert not log.error.any()
    assert not one.motor["torque_enable"]


def test_the_wiggles_are_in_the_log_where_the_commands_are(tmp_path: Path) -> None:
    one = bench()
    one.capture(tmp_path, 0.6, seconds=2.0, coded=True)
    with (tmp_path / "trials/f0_60.commands.csv").open() as file:
        rows = list(csv.reader(file))
    assert ",".join(rows[0]) == COMMANDS_HEADER
    chips = [(float(t), float(v)) for t, part, v in rows[1:] if part == "start_code"]
    assert tuple(np.sign([v for _, v in chips])) == START_CODE
    assert sum(part == "end_code" for _, part, _ in rows[1:]) == len(START_CODE)
    log = load_motor(logged(tmp_path))
    start_s = chips[0][0]
    wave = np.repeat(START_CODE, 25)  # (400,) at 100 Hz
    seen = np.interp(start_s - 1 + np.arange(600) / 100, log.time_s, log.velocity_rad_s)
    found_s = int(np.argmax(np.correlate(seen, wave, "valid"))) / 100 - 1
    assert 0 <= found_s <= 0.2  # the motor ramps: its mean lag


def test_speeds_out_of_reach_are_refused_before_anything_turns(tmp_path: Path) -> None:
    one = bench()
    with pytest.raises(UserError, match=r"1\.3 turns/s is out of reach; expected: at most 1\.20 at 12\.0 V"):
        one.capture(tmp_path / "new", 0.6, 1.3)
    assert one.motor["present_velocity"] == 0
    assert not (tmp_path / "new").exists()


def test_another_model_is_refused(tmp_path: Path) -> None:
    one = bench()
    one.motor["model_number"] = 1170
    with pytest.raises(UserError, match="another model; found: 1170; expected: 1180"):
        one.capture(tmp_path)


def test_a_motor_left_tripped_and_in_another_mode_is_made_ready(tmp_path: Path) -> None:
    one = bench()
    motor = one.motor
    motor["operating_mode"], motor["drive_mode"], motor["bus_watchdog"], motor["torque_enable"] = 3, 5, -1, 1
    (result,) = one.capture(tmp_path)
    assert motor["drive_mode"] == 1  # the direction stays
    assert result.rows > 100


@pytest.mark.parametrize(
    ("break_it", "reason"),
    [
        (lambda motor: raise_error(motor, OVERLOAD), "the motor reports: overload"),
        (lambda motor: raise_error(motor, INPUT_VOLTAGE), "input voltage out of range"),
        (power_cycle, "clock jumped"),
        (lambda motor: operator.setitem(motor, "present_temperature", 75), "too warm; found: 75 degrees C"),
        (lambda motor: setattr(motor, "load_nm", 30.0), "does not follow|current is too high"),
    ],
)
def test_what_fails_stops_the_motor_and_is_reported_and_the_log_stays(tmp_path: Path, break_it, reason) -> None:  # type: ignore[no-untyped-def]
    one = bench()
    one.events.append((3.0, lambda: break_it(one.motor)))
    with pytest.raises(MotorFault, match=reason):
        one.capture(tmp_path, 0.6, seconds=10.0)
    assert not one.motor["torque_enable"]
    assert load_motor(logged(tmp_path)).time_s.size > 200
    assert any("the trial was not added to the session" in line for line in one.messages)
    assert not (tmp_path / "session.toml").exists()


def test_a_host_that_slept_too_long_hears_that_the_watchdog_stopped_the_motor(tmp_path: Path) -> None:
    one = bench()
    one.events.append((3.0, lambda: one.clock.sleep(2.0)))
    with pytest.raises(MotorFault, match=r"bus watchdog has stopped it: it heard nothing for 0\.4 s"):
        one.capture(tmp_path, seconds=10.0)
    assert one.stopped_soon


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)])
def test_signals_stop_the_motor_and_finished_trials_are_kept(tmp_path: Path, number: int, code: int) -> None:
    one = bench()
    one.events += [(5.0, lambda: os.kill(os.getpid(), number)), (5.0, lambda: os.kill(os.getpid(), signal.SIGINT))]
    with pytest.raises(Interrupted) as caught:
        one.capture(tmp_path, 0.6, 0.8, seconds=2.0)
    assert caught.value.exit_code == code
    assert not one.motor["torque_enable"]
    assert [trial.name for trial in load_session(tmp_path).trials] == ["f0_60"]
    assert load_motor(logged(tmp_path, "f0_80")).time_s.size > 50
    assert one.capture(tmp_path, 0.8)[0].name == "f0_80_2"  # what lies there is not written over


def test_an_exception_in_the_middle_of_an_answer_still_sends_the_torque_off(tmp_path: Path) -> None:
    """The SDK's `is_using` stays True then, and swallows every later packet."""
    one = bench()
    read = one.port.readPort

    def interrupted(length: int) -> bytes:
        if one.clock() > 3.0:
            one.port.readPort = read  # type: ignore[method-assign]
            raise KeyboardInterrupt
        return read(length)

    one.port.readPort = interrupted  # type: ignore[method-assign]
    with pytest.raises(KeyboardInterrupt):
        one.capture(tmp_path, seconds=10.0)
    assert not one.motor["torque_enable"]
    assert load_motor(logged(tmp_path)).time_s.size > 200


def test_a_full_disk_stops_the_motor(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    one = bench()

    def full(*_: object, **__: object) -> None:
        raise UserError("x.motor.csv: cannot be written; found: No space left on device")

    monkeypatch.setattr(trials.TrialLog, "measured", full)
    with pytest.raises(UserError, match="No space left"):
        one.capture(tmp_path)
    assert not one.motor["torque_enable"]
    assert list((tmp_path / "trials").iterdir()) == []  # no log without rows


@pytest.mark.long
def test_no_answer_is_logged_under_the_time_of_another_question(tmp_path: Path) -> None:
    kinds = (Fault.REPLY_LATE, Fault.REPLY_LOST, Fault.REPLY_CUT, Fault.GARBAGE, Fault.REQUEST_LOST)
    for seed in range(4):
        one, out = bench(Faults(seed, kinds, rate=0.02), load=0.0, seed=seed), tmp_path / str(seed)
        one.capture(out, 0.6, seconds=8.0)  # and none of these ends the run
        log = load_motor(logged(out))
        steady = (log.time_s > log.time_s[0] + 1.5) & (log.time_s < log.time_s[0] + 8)
        line = np.polynomial.Polynomial.fit(log.time_s[steady], log.position_rad[steady], 1)
        off_s = (log.position_rad[steady] - line(log.time_s[steady])) / (2 * math.pi * 0.6)
        assert np.abs(off_s).max() < 0.005
        assert isinstance(one.motor, FaultyEmulator)
        assert one.motor.happened > 5
