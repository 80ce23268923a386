"""The robot's computer has the standard library, `dynamixel_sdk` and the serial library that it brings, no more."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]

BLOCKED = """
import importlib.abc, sys

class OnlyTheRobots(importlib.abc.MetaPathFinder):
    ALLOWED = sys.stdlib_module_names | {"calib", "dynamixel_sdk", "serial"}

    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] not in self.ALLOWED:
            raise ModuleNotFoundError(f"not on the robot: {name}")
        if name.startswith("calib.") and name.split(".")[1] not in ("capture", "motor"):
            raise ModuleNotFoundError(f"not for the robot: {name}")

sys.meta_path.insert(0, OnlyTheRobots())
"""


def on_the_robot(code: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-W", "error", "-c", BLOCKED + code]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60)


def test_the_blocker_blocks() -> None:
    assert "not on the robot: numpy" in on_the_robot("import numpy").stderr
    assert "not on the robot: session" in on_the_robot("import session").stderr


def test_every_module_imports_with_the_standard_library_and_the_sdk_alone() -> None:
    code = """
import importlib, pkgutil, calib.capture
for module in pkgutil.iter_modules(calib.capture.__path__, "calib.capture."):
    if not module.name.endswith("__main__"):
        importlib.import_module(module.name)
print("all")
"""
    done = on_the_robot(code)
    assert (done.returncode, done.stdout) == (0, "all\n"), done.stderr


def test_the_command_runs_there() -> None:
    done = on_the_robot("import runpy, sys; sys.argv = ['x', 'run', '--help']; runpy.run_module('calib.capture')")
    assert done.returncode == 0, done.stderr
    assert "1.2 crank turns/s at 12 V" in " ".join(done.stdout.split())


def test_the_names_that_the_package_promises_are_there() -> None:
    code = "import calib.capture as c; print([name for name in c.__all__ if not hasattr(c, name)])"
    assert on_the_robot(code).stdout == "[]\n"
