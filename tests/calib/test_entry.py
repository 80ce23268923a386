"""What `import calib` gives, and what it costs."""

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args

import pytest

import calib
import calib as front
from calib import cli
from calib import terminal as arguments
from calib.options import STARTS, ObjectiveName
from calib.results.twin import SwimTwin
from swimcal.errors import InputError
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
    groups = {"camera": ("board", "lens", "scale"), "policy": ("train", "evaluate", "play")}
    group = [name for name, own in groups.items() if command in own]
    outcome = calib(*group, command, "--help")
    assert outcome.code == 0
    assert f"calib {' '.join([*group, command])}" in outcome.out
    assert "Example: calib" in outcome.out or command == "capture"
    assert not re.search(r"range>|list\[|<(int|str|float)>", outcome.out)


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
    assert b"Verdict of the fit: " in shown.stdout
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


@pytest.fixture(scope="module")
def twin() -> SwimTwin:
    return calib.load_twin()


@pytest.mark.parametrize(
    ("call", "match"),
    [
        (lambda: calib.run([]), "sessions: no session; found an empty list"),
        (lambda: calib.run(["pool"], jobs=0), "jobs: no number of sessions at a time; found 0"),
        (lambda: calib.run(["pool"], effort="fast"), "effort: no such effort; found 'fast'"),  # type: ignore[arg-type]
        (lambda: calib.fit(None), "session: no session; found None"),  # type: ignore[arg-type]
        (lambda: calib.load_twin(coefficients=[-0.4, 2, 6, 4, 1]), r"found \[-0.4, 2, 6, 4, 1\]"),
        (lambda: calib.load_twin(effects="tendon_slick"), "'tendon_slick'.*tendon_slack"),
        (lambda: calib.load_tracks("nothing.csv", ["nose"], fps=-3), "--fps: not a frame rate; found -3"),
        (lambda: calib.convert_tracks("nothing.csv", "out.h5", "deeplabcut"), "--out: HDF5 is not written"),
    ],
)
def test_what_means_nothing_is_refused(
    call: Callable[[], object], match: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=match):
        call()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ({"frequency_hz": []}, "frequency_hz: no frequency; found an empty list"),
        ({"frequency_hz": [1.0], "seconds": 0}, "seconds: no duration; found 0"),
        ({"frequency_hz": 1.0, "fps": float("nan")}, "fps: no frame rate; found nan"),
        ({"frequency_hz": "fast"}, "frequency_hz: no frequency; found fast"),
    ],
)
def test_swims_that_cannot_be_are_refused(twin: SwimTwin, arguments: dict[str, Any], match: str) -> None:
    with pytest.raises(InputError, match=match):
        twin.swim(**arguments)


def test_tracks_of_no_trial_are_refused_with_the_choices(finished: Path) -> None:
    with pytest.raises(InputError, match=r"trial: no tracks of this trial; found 'f1_25'.*slow"):
        _ = calib.track(finished, progress=False)["f1_25"]


@pytest.mark.parametrize("hz", [0.0, float("nan")])
def test_a_command_that_is_none_is_refused_before_there_is_a_session(fresh: Path, tmp_path: Path, hz: float) -> None:
    tracks = next((fresh / "trials").glob("*.csv.gz"))
    with pytest.raises(InputError, match="--commands: not a command"):
        calib.new_session(tmp_path / "new", tracks=[tracks], commands_hz=[hz])
    assert not (tmp_path / "new").exists()


def test_a_folder_in_use_is_refused_before_anything_is_simulated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    monkeypatch.setattr("swimsynth.session.make_session", lambda *_: pytest.fail("simulated"))
    with pytest.raises(InputError, match="cannot make a session here"):
        calib.new_session(tmp_path, synthetic=True, progress=False)
