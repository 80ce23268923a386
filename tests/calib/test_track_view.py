"""`calib view`: what the recording holds before and after a fit, and opening it."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import calib as front
from tests.calib.door import Front, assert_reports, calibration_of, edit
from tests.calib.filmed import FRAMES, NAMES
from tests.calib.test_left_out import MOTOR_LOG
from tests.cases import later
from tests.reports.recording.contents import RecordingContents, read_recording

SCALARS = "Scalars:scalars"


def shown(calib: Front, folder: Path) -> RecordingContents:
    """The recording, made anew."""
    outcome = calib("view", folder)
    assert outcome.code == 0, outcome.err
    assert outcome.out.splitlines()[-1] == str(folder / "results" / "session.rrd")
    return read_recording(folder / "results" / "session.rrd")


def test_before_a_fit_it_shows_videos_and_tracks(calib: Front, tracked: Path) -> None:
    contents = shown(calib, tracked)

    for name in NAMES:
        assert contents.entities[f"/{name}/confidence"].rows[SCALARS] == FRAMES[name]
        assert any(entity.startswith(f"/{name}/picture/video") for entity in contents.entities)
        assert (tracked / "results" / "tracking" / f"{name}.proxy.mp4").is_file()
    assert contents.blueprints == 1
    assert not [entity for entity in contents.entities if "residual" in entity or "twin" in entity]
    assert not (tracked / "results" / "calibration.json").exists()


@pytest.mark.long
@pytest.mark.parametrize("again", [False, *later(True)])
def test_after_a_fit_of_any_effort_it_shows_the_twin_next_to_them(calib: Front, fitted: Path, again: bool) -> None:
    if again:
        assert calib("fit", fitted, "--effort", "full").code == 0
    contents = shown(calib, fitted)

    calibration = calibration_of(fitted)
    for name in NAMES:
        residual = contents.entities[f"/{name}/residual_mm"]
        assert residual.rows[SCALARS] == FRAMES[name]
        values = np.concatenate([part.to_numpy(zero_copy_only=False) for part in residual.columns[SCALARS]])
        samples = np.concatenate(values)
        assert 0 < np.isfinite(samples).sum() < samples.size  # none in the warm-up
        assert np.nanmean(samples) == pytest.approx(calibration["trials"][name]["marker_error_all_mm"], rel=0.01)
        assert any(entity.startswith(f"/{name}/picture/twin") for entity in contents.entities)


@pytest.mark.long
def test_a_fit_that_is_out_of_date_is_not_shown(calib: Front, fitted: Path) -> None:
    edit(fitted / "session.toml", "warmup_s = 1.0", "warmup_s = 0.9")

    assert "is out of date, not shown" in calib("view", fitted).out
    contents = read_recording(fitted / "results" / "session.rrd")
    assert not [entity for entity in contents.entities if "residual" in entity]


@pytest.mark.long
def test_tracks_too_short_to_measure_are_still_shown(calib: Front, tracked: Path) -> None:
    edit(tracked / "session.toml", "warmup_s = 1.0", "warmup_s = 9.0")

    assert shown(calib, tracked).entities["/slow/confidence"].rows[SCALARS] == FRAMES["slow"]


def test_a_session_with_nothing_to_show_is_reported_so(calib: Front, fresh: Path) -> None:
    head = (fresh / "session.toml").read_text().split("[[trial]]")[0]
    trial = '[[trial]]\nname = "logged"\nkind = "swim"\nmotor = "logged.motor.csv"\ncommanded_hz = 0.8\n'
    (fresh / "session.toml").write_text(head + trial)
    (fresh / "logged.motor.csv").write_text(MOTOR_LOG)

    assert_reports(calib("view", fresh), "nothing to show", "Trial logged")
    assert not (fresh / "results" / "session.rrd").exists()


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """The commands that would have been started."""
    commands: list[list[str]] = []
    monkeypatch.setattr(subprocess, "Popen", lambda command, **_: commands.append(command))
    made = "calib.viewer.make_recording"
    monkeypatch.setattr(made, lambda pipeline: pipeline.session.results / "session.rrd")
    return commands


def executable(folder: Path) -> Path:
    path = folder / "rerun"
    folder.mkdir()
    path.write_text("#!/bin/sh\n")
    path.chmod(0o755)
    return path


def test_the_viewer_that_was_installed_along_is_opened(
    calib: Front, fresh: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, started: list[list[str]]
) -> None:
    along, other = executable(tmp_path / "along"), executable(tmp_path / "other")
    monkeypatch.setenv("PATH", str(other.parent))
    monkeypatch.setattr(sys, "executable", str(along.parent / "python"))
    monkeypatch.setenv("DISPLAY", ":0")
    recording = str(fresh / "results" / "session.rrd")

    assert calib("view", fresh, "--open").code == 0
    along.unlink()
    assert calib("view", fresh, "--open").code == 0
    assert started == [[str(along), recording], [str(other), recording]]


def test_without_a_viewer_it_says_so_and_the_recording_stands(
    calib: Front, fresh: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, started: list[list[str]]
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    outcome = calib("view", fresh, "--open")

    recording = str(fresh / "results" / "session.rrd")
    assert (outcome.code, outcome.out) == (2, f"{recording}\n")
    assert "the viewer cannot be opened" in outcome.err
    assert "pip install rerun-sdk" in outcome.err
    assert recording in outcome.err
    assert started == []


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="other systems have a desktop")
def test_without_a_display_one_line_says_what_to_do(
    calib: Front, fresh: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, started: list[list[str]]
) -> None:
    viewer = executable(tmp_path / "along")
    monkeypatch.setattr(sys, "executable", str(viewer.parent / "python"))
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    outcome = calib("view", fresh, "--open")

    recording = str(fresh / "results" / "session.rrd")
    assert (outcome.code, outcome.out) == (2, f"{recording}\n")
    (line,) = [line for line in outcome.err.splitlines() if "no display here" in line]
    assert f"copy {recording} to a computer with a screen" in line
    assert f"run `{viewer} --serve-web {recording}` here" in line
    assert started == []


def test_where_it_cannot_be_shown_inline_a_sentence_says_why(fresh: Path) -> None:
    made = front.view(fresh, inline=True)
    assert made.file.is_file()
    assert f"open {made.file} in the Rerun viewer" in made.notes[-1]
