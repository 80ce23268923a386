"""What `import calib` gives, and what it costs."""

import os
import subprocess
import sys
from pathlib import Path
from typing import get_args

import pytest

import calib as front
from calib import cli
from calib import terminal as arguments
from calib.options import STARTS, ObjectiveName
from tests.calib.door import Front
from tracking.follow_video import TRACKERS
from tracking.formats import FORMATS


def test_it_has_the_names_it_promises_and_no_other() -> None:
    assert [getattr(front, name).__name__.removeprefix("calib.") for name in front.__all__] == list(front.__all__)
    with pytest.raises(AttributeError, match="module 'calib' has no attribute 'nonsense'"):
        _ = front.nonsense


COMPUTING = {
    "scipy",
    "pandas",
    "xarray",
    "matplotlib",
    "mujoco",
    "cv2",
    "av",
    "skimage",
    "emcee",
    "nlopt",
    "arviz",
    "rerun",
}
"""What takes long to load, and is used only once there is work."""


@pytest.mark.parametrize(
    ("code", "absent"),
    [
        ("import calib", {"numpy", "fitting", "swimcal", *COMPUTING}),
        ("import calib; calib.fit, calib.run, calib.open_session", {"rich", "reports", "diagnosis", *COMPUTING}),
        ("import calib.cli", {"numpy", "fitting", "swimcal", *COMPUTING}),
    ],
)
def test_importing_it_loads_nothing_that_it_does_not_use(code: str, absent: set[str]) -> None:
    """So that a part of it may run where nothing else is installed, and help comes within a second instead of five."""
    code = f"import sys; {code}; print(*{absent} & set(sys.modules))"
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)

    assert shown.stdout.strip() == ""


def test_ctrl_c_while_it_is_still_loading_ends_as_at_any_other_time() -> None:
    code = """
import sys
class Interrupted:
    def find_spec(self, name, *_):
        if name == "typer":
            raise KeyboardInterrupt
sys.meta_path.insert(0, Interrupted())
from calib.entry import main
main()
"""
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)

    assert shown.returncode == 130
    assert shown.stderr.strip() == "calib: stopped before anything was begun."


def test_what_its_options_offer_is_what_there_is() -> None:
    assert get_args(arguments.EffortOption) == tuple(STARTS)
    assert get_args(arguments.ObjectiveOption) == get_args(ObjectiveName)
    assert get_args(arguments.TrackerOption) == tuple(TRACKERS)
    assert tuple(FORMATS) == arguments.FORMS


@pytest.mark.parametrize("command", [*(command.__name__ for command in cli.COMMANDS), "capture"])
def test_every_command_says_how_it_is_used(command: str, calib: Front) -> None:
    group = ("camera",) if command in ("board", "lens", "scale") else ()
    outcome = calib(*group, command, "--help")
    assert outcome.code == 0
    assert f"calib {' '.join([*group, command])}" in outcome.out
    assert "Example: calib" in outcome.out or command == "capture"


@pytest.mark.parametrize(
    ("environment", "more"),
    [
        pytest.param({"PYTHONIOENCODING": "ascii"}, (), marks=pytest.mark.long),
        ({"PYTHONIOENCODING": "cp1252"}, ("--verbose",)),
        pytest.param({"LC_ALL": "C"}, ("--verbose",), marks=pytest.mark.long),
        pytest.param({"PYTHONUTF8": "0"}, (), marks=pytest.mark.long),
    ],
)
def test_what_a_terminal_cannot_show_is_spelled_out(
    environment: dict[str, str], more: tuple[str, ...], finished: Path
) -> None:
    """What is wrong, and then the result, in one process for each encoding."""
    folder = finished.rename(finished.with_name("−1 ± 0.1 水"))
    right, wrong = ["calib", "fit", str(folder), "--effort", "quick", *more], ["calib", "fit", str(folder / "−2")]
    code = f"""
import sys
from contextlib import suppress
from calib.entry import main
from tests.calib.door import hurried
hurried()
sys.argv = {wrong!a}
with suppress(SystemExit):
    main()
sys.argv = {right!a}
main()
"""
    command = [sys.executable, "-c", code]
    shown = subprocess.run(command, capture_output=True, env=os.environ | environment, check=False)

    assert shown.returncode == 0, shown.stderr
    assert b"Verdict: " in shown.stdout
    assert b"Traceback" not in shown.stderr
    assert b"no session.toml here" in shown.stderr
    if environment.get("PYTHONIOENCODING") == "ascii":
        assert rb"-1 +/- 0.1 \u6c34" in shown.stdout
        assert rb"-1 +/- 0.1 \u6c34" in shown.stderr


@pytest.mark.long
def test_a_backend_of_matplotlib_that_there_is_not_changes_nothing(finished: Path) -> None:
    command = [sys.executable, "-m", "calib", "report", str(finished)]
    shown = subprocess.run(command, capture_output=True, env=os.environ | {"MPLBACKEND": "nonsense"}, check=False)
    assert shown.returncode == 0, shown.stderr
    assert b"Traceback" not in shown.stderr
