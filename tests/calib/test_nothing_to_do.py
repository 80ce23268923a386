"""A command with nothing to do says again what stands: it measures and simulates nothing, and loads no library."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

import calib as package
from calib.kept_output import OUTPUT, standing_output
from calib.pipeline import open_session
from calib.stages import recordings, videos
from fitting import calibration
from swimcal.session import Session, TrialSpec
from swimcal.twin import Twin
from tests.calib.door import Front

COMMANDS = ("fit", "posterior", "diagnose", "report", "run")
HEAVY = ("numpy", "mujoco", "scipy", "xarray", "pandas", "matplotlib", "swimcal", "calib.interface")


@pytest.fixture
def idle(monkeypatch: pytest.MonkeyPatch) -> None:
    """Measuring, tracking and simulating fail."""

    def never(*_args: object, **_options: object) -> None:
        raise AssertionError

    for place, name in (
        (recordings, "measure_trial"),
        (recordings, "measure_dry_run"),
        (recordings, "measure_decay_trial"),
        (recordings, "read_motor"),
        (recordings, "load_tracks"),
        (videos, "follow_video"),
        (calibration, "calibrate_at"),
        (Twin, "simulate"),
    ):
        monkeypatch.setattr(place, name, never)


@pytest.mark.long
@pytest.mark.usefixtures("idle")
def test_a_repeated_function_measures_and_simulates_nothing(whole: Path) -> None:
    assert package.fit(whole, progress=False).name == "fit of quick effort"
    assert package.posterior(whole, progress=False).name == "posterior of quick effort of the fit of quick effort"
    assert package.diagnose(whole, progress=False).name == "diagnosis of quick effort"
    assert package.run(whole, progress=False).made == ()
    assert package.report(whole).file == whole / "results" / "report.html"


@pytest.mark.long
def test_a_repeated_command_says_the_same(calib: Front, whole: Path) -> None:
    for command in COMMANDS:
        for options in ((), ("-v",)) if command == "fit" else ((),):
            (whole / "results" / OUTPUT).unlink(missing_ok=True)
            first = calib(command, whole, *options)
            again = standing_output(command, whole, None, verbose=bool(options))
            assert again == first.out, command
            assert calib(command, whole, *options).out == first.out, command


def test_a_repeated_command_loads_none_of_the_libraries(calib: Front, whole: Path) -> None:
    assert calib("fit", whole).code == 0
    script = (
        "import sys\nfrom calib.cli import app\n"
        f"app(['fit', {str(whole)!r}], standalone_mode=False)\n"
        f"print([name for name in {HEAVY!r} if name in sys.modules])"
    )
    shown = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    assert shown.splitlines()[-1] == "[]"
    assert shown.splitlines()[-2] == str(whole / "results" / "calibration.json")


@pytest.mark.long
def test_without_an_effort_that_of_the_results_that_stand_is_taken(calib: Front, whole: Path) -> None:
    (whole / "results" / "posterior.nc").unlink()
    before = (whole / "results" / "calibration.json").read_bytes()
    assert "fit of quick effort" in calib("fit", whole).out
    assert (whole / "results" / "calibration.json").read_bytes() == before
    assert "posterior of quick effort of the fit of quick effort" in calib("posterior", whole).out


BEHIND_AN_ANSWER = (
    "trials/fast.csv.gz",
    "session.toml",
    "results/calibration.json",
    "results/calibrated.xml",
    "results/report.html",
    "results/.stages.json",
)


def test_no_answer_stands_when_a_file_that_it_rests_on_changed_or_for_another_effort_or_program(
    calib: Front, whole: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert calib("report", whole).code == 0
    for file in (whole / name for name in BEHIND_AN_ANSWER):
        before = file.read_bytes()
        assert all(standing_output(command, whole, None) for command in COMMANDS), file
        file.write_bytes(before + b"\n")
        assert not any(standing_output(command, whole, None) for command in COMMANDS), file
        file.write_bytes(before)
    assert standing_output("fit", whole, "quick")
    assert standing_output("fit", whole, "full") is None
    monkeypatch.setattr("calib.kept_output._program", lambda: "another")
    assert standing_output("fit", whole, "quick") is None


def test_a_file_that_would_be_an_input_is_noticed_when_it_appears(
    calib: Front, whole: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    edits = whole / "trials" / "slow.edits.jsonl"
    monkeypatch.setattr(Session, "absent_inputs", lambda _session: (edits,))
    (whole / "results" / OUTPUT).unlink(missing_ok=True)
    assert calib("report", whole).code == 0
    assert standing_output("report", whole, None)
    edits.write_text("")
    assert standing_output("report", whole, None) is None


def test_boxes_edits_and_commands_would_be_inputs(tmp_path: Path, whole: Path) -> None:
    trial = TrialSpec("f1", "swim", video=tmp_path / "f1.mp4", motor=tmp_path / "f1.motor.csv")
    session = replace(open_session(whole), trials=(trial,))
    assert {path.name for path in session.absent_inputs()} == {"f1.boxes.json", "f1.edits.jsonl", "f1.commands.csv"}
    (tmp_path / "f1.edits.jsonl").write_text("")
    assert {path.name for path in session.absent_inputs()} == {"f1.boxes.json", "f1.commands.csv"}
