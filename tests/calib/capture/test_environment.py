"""The robot's computer has the standard library, `dynamixel_sdk` and the serial library that it brings, no more."""

import shutil
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import dynamixel_sdk
import pytest
import serial

from swimcal.motor_log import load_commands, load_motor
from swimcal.session import load_session

ROOT = Path(__file__).resolve().parents[3]
ON_THE_ROBOT = ("calib/__init__.py", "calib/capture")  # what docs/bench.md tells to copy
ALONE = (sys.executable, "-S", "-E", "-s", "-W", "error")  # no site-packages, no PYTHONPATH
BAUD = "1000000"


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with all that the robot's computer has next to the standard library."""
    folder = tmp_path_factory.mktemp("robot")
    (folder / "calib").mkdir()
    for name in ON_THE_ROBOT:
        copied = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
        copied(ROOT / name, folder / name)
    for package in (dynamixel_sdk, serial):
        assert package.__file__
        shutil.copytree(Path(package.__file__).parent, folder / package.__name__)
    return folder


def on_the_robot(robot: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([*ALONE, *arguments], cwd=robot, capture_output=True, text=True, timeout=60)


def capturing(*arguments: str) -> Sequence[str]:
    return ("-m", "calib.capture", *arguments)


@pytest.mark.parametrize("name", ["numpy", "swimcal", "calib.pipeline"])
def test_nothing_else_is_there(robot: Path, name: str) -> None:
    assert f"No module named '{name}'" in on_the_robot(robot, "-c", f"import {name}").stderr


def test_every_module_imports_and_has_the_names_that_the_package_promises(robot: Path) -> None:
    code = """
import importlib, pkgutil, calib.capture
for module in pkgutil.iter_modules(calib.capture.__path__, "calib.capture."):
    if not module.name.endswith("__main__"):
        importlib.import_module(module.name)
print([name for name in calib.capture.__all__ if not hasattr(calib.capture, name)])
"""
    done = on_the_robot(robot, "-c", code)
    assert (done.returncode, done.stdout) == (0, "[]\n"), done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="needs pseudo-terminals")
def test_a_trial_is_captured_there_on_a_real_pseudo_terminal(robot: Path, tmp_path: Path) -> None:
    emulate = [*ALONE, *capturing("emulate", "--baud", BAUD, "--load", "0.3")]
    with subprocess.Popen(emulate, cwd=robot, stdout=subprocess.PIPE, text=True) as motor:
        assert motor.stdout is not None
        port = motor.stdout.readline().strip()
        drive = ("run", "--port", port, "--baud", BAUD, "--hz", "0.6", "--seconds", "0.5", "--no-code")
        done = on_the_robot(robot, *capturing(*drive, "--out", str(tmp_path / "pool")))
        motor.send_signal(signal.SIGTERM)
        left = motor.communicate(timeout=20)[0]

    assert (done.returncode, done.stderr) == (0, "")
    assert "Ended. The motor is not driven" in left
    (trial,) = load_session(tmp_path / "pool").trials
    assert trial.motor is not None
    assert trial.commands is not None
    assert load_motor(trial.motor).time_s.size > 20
    assert load_commands(trial.commands).part == ("rest", "drive", "rest")
