"""The command on a real pseudo-terminal, and what it says to bad input."""

import contextlib
import os
import pty
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import serial

from calib.capture.emulator import MotorEmulator, pseudo_terminal
from calib.capture.functions import main
from swimcal.motor_log import load_motor
from swimcal.session import load_session
from tests.calib.motor.faults import ALL_FAULTS, Fault, Faults, FaultyEmulator
from tests.cases import later

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="needs pseudo-terminals")
ROOT = Path(__file__).resolve().parents[3]
BAUD = 1_000_000


@pytest.fixture
def motor() -> MotorEmulator:
    return MotorEmulator(load_nm=0.3)


@pytest.fixture
def port(motor: MotorEmulator) -> Iterator[str]:
    with pseudo_terminal(motor, BAUD) as path:
        yield path


def arguments(port: str, out: Path, *more: str) -> list[str]:
    return ["run", "--port", port, "--baud", str(BAUD), "--out", str(out), "--no-code", "--hz", "0.6", *more]


def started(port: str, out: Path, *more: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "calib.capture", *arguments(port, out, *more)]
    return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def wait_for(what: Callable[[], bool], seconds: float = 20.0) -> bool:
    until = time.monotonic() + seconds
    while not what() and time.monotonic() < until:
        time.sleep(0.02)
    return what()


def turning(motor: MotorEmulator) -> bool:
    return motor["present_velocity"] > 80


def test_a_terminal_shows_speed_current_and_temperature_while_the_motor_turns(port: str, tmp_path: Path) -> None:
    """In one line, which is gone before a result is printed."""
    screen, terminal = pty.openpty()
    command = [sys.executable, "-m", "calib.capture", *arguments(port, tmp_path / "pool", "--seconds", "2")]
    shown = b""
    with subprocess.Popen(command, cwd=ROOT, stdout=terminal, stderr=terminal, close_fds=True) as process:
        os.close(terminal)
        with contextlib.suppress(OSError):  # the other end was closed
            while part := os.read(screen, 4096):
                shown += part
    os.close(screen)
    lines = shown.decode().split("\r\x1b[K")
    pattern = r"f0_60: (-?[\d.]+) turns/s, ([\d.]+) A, (\d+) degrees C, \d s left"
    seen = [match for line in lines if (match := re.fullmatch(pattern, line))]
    assert process.returncode == 0
    assert len(seen) >= 5
    assert max(float(match[1]) for match in seen) == pytest.approx(0.6, abs=0.02)
    assert max(float(match[2]) for match in seen) > 0
    assert lines[-1].startswith("f0_60: ")
    assert "rows at" in lines[-1]


def test_a_capture_over_a_terminal_is_a_session(port: str, motor: MotorEmulator, tmp_path: Path) -> None:
    more = ("--seconds", "1", "--kind", "dry", "--role", "holdout")
    assert main(arguments(port, tmp_path / "pool", *more)) == 0
    (trial,) = load_session(tmp_path / "pool").trials
    assert (trial.name, trial.kind, trial.role) == ("f0_60", "dry", "holdout")
    assert not motor["torque_enable"]


@pytest.mark.parametrize(
    ("number", "code", "reason"),
    [(signal.SIGINT, 130, "stopped by Ctrl-C"), (signal.SIGTERM, 143, "stopped by SIGTERM")],
)
def test_a_signal_stops_the_motor_and_the_log_stays(
    port: str, motor: MotorEmulator, tmp_path: Path, number: int, code: int, reason: str
) -> None:
    with started(port, tmp_path, "--seconds", "60") as process:
        assert wait_for(lambda: turning(motor))
        process.send_signal(number)
        _, printed = process.communicate(timeout=20)
    assert (process.returncode, motor["torque_enable"]) == (code, 0)
    assert reason in printed
    assert load_motor(tmp_path / "trials/f0_60.motor.csv").time_s.size > 10


def test_a_killed_host_leaves_a_motor_that_the_watchdog_stops_and_a_readable_log(
    port: str, motor: MotorEmulator, tmp_path: Path
) -> None:
    with started(port, tmp_path, "--seconds", "60") as process:
        assert wait_for(lambda: turning(motor))
        process.kill()
        killed_s = time.monotonic()
        process.communicate(timeout=20)
    assert wait_for(lambda: motor.stopped, 1.0)
    assert time.monotonic() - killed_s < 1.0
    assert motor["bus_watchdog"] < 0
    assert load_motor(tmp_path / "trials/f0_60.motor.csv").time_s.size > 10
    assert main(arguments(port, tmp_path, "--seconds", "0.5")) == 0  # and the next run finds it ready
    assert [trial.name for trial in load_session(tmp_path).trials] == ["f0_60_2"]


def test_a_lost_cable_ends_with_a_motor_fault(
    port: str, motor: MotorEmulator, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    threading.Timer(1.5, lambda: setattr(motor, "connected", False)).start()
    assert main(arguments(port, tmp_path, "--seconds", "60")) == 3
    printed = capsys.readouterr()
    assert "did not confirm that it stopped" in printed.out + printed.err
    assert wait_for(lambda: motor.stopped, 1.0)
    assert load_motor(tmp_path / "trials/f0_60.motor.csv").time_s.size > 10


@pytest.mark.parametrize("seed", [1, 2, *later(*range(3, 20))])
def test_random_faults_on_a_real_terminal_end_with_a_stopped_motor(tmp_path: Path, seed: int) -> None:
    kinds = ALL_FAULTS if seed % 2 else (Fault.DISCONNECT, Fault.GARBAGE, Fault.REPLY_LATE, Fault.REQUEST_CORRUPTED)
    device = FaultyEmulator(Faults(seed, kinds, rate=0.02, after=20), load_nm=0.3)
    with pseudo_terminal(device, BAUD) as port:
        arguments = ["run", "--port", port, "--baud", "1000000", "--hz", "0.8", "--seconds", "1", "--no-code"]
        assert main([*arguments, "--out", str(tmp_path)]) in (0, 2, 3)
        time.sleep(0.5)
        assert device.stopped
    for log in tmp_path.glob("trials/*.motor.csv"):
        load_motor(log)


def test_another_program_on_the_port_is_refused(port: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with serial.Serial(port, BAUD, exclusive=True):
        assert main(arguments(port, tmp_path)) == 2
    assert "in use by another program" in capsys.readouterr().err


def test_a_wrong_baud_rate_is_reported(port: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*arguments(port, tmp_path), "--baud", "57600"]) == 2
    assert "calib capture scan" in capsys.readouterr().err


def test_scan_finds_the_motor_and_says_how_to_reach_it(port: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["scan", "--port", port, "--port", "/dev/not_there", "--baud", "57600", "--baud", str(BAUD)]) == 0
    printed = capsys.readouterr()
    assert printed.out == f"--port {port} --baud {BAUD} --id 1  (XW540-T140-R)\n"
    assert "/dev/not_there cannot be opened" in printed.err


def test_scan_without_a_motor_says_what_to_look_at(
    port: str, motor: MotorEmulator, capsys: pytest.CaptureFixture[str]
) -> None:
    motor["model_number"] = 1170
    assert main(["scan", "--port", port, "--baud", str(BAUD)]) == 2
    printed = capsys.readouterr()
    assert "another Dynamixel, model 1170" in printed.out
    assert "no XW540-T140-R answers" in printed.err


def test_an_emulated_motor_that_cannot_be_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["emulate", "--load", "9", "--id", "300"]) == 2
    printed = capsys.readouterr().err
    assert "--load: found 9; expected: 0 to 6.9 N m" in printed
    assert "--id: found 300" in printed


def test_all_faults_of_the_options_are_reported_at_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bad = ["run", "--port", "x", "--baud", "12", "--id", "300", "--hz", "0.6,fast,9,-1", "--seconds", "0"]
    assert main([*bad, "--max-current", "nan", "--out", str(tmp_path / "new")]) == 2
    printed = capsys.readouterr().err
    assert "--baud: found 12; choices: 9600, 57600" in printed
    assert "--id: found 300; expected: 0 to 252" in printed
    for speed in ("'fast'", "'9'", "'-1'"):
        assert (
            f"--hz: found {speed}; expected: 0.01 to 1.48 crank turns a second; up to 1.2 crank turns a second at 12 V"
            in printed
        )
    assert "--seconds: found 0" in printed
    assert "--max-current: found nan" in printed
    assert not (tmp_path / "new").exists()
