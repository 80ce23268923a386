"""Trials that cannot be used, and sessions that hold nothing else."""

import gzip
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from calib.options import Options
from calib.pipeline import Pipeline, open_session
from swimcal.motor_log import MOTOR_COLUMNS
from swimcal.tracks import load_tracks, pixels_of, save_tracks
from tests.calib.door import PLAN, Front, assert_reports, calibration_of, edit, files_in
from tests.calib.filmed import change_boxes
from tests.cases import changed

MOTOR_LOG = ",".join(MOTOR_COLUMNS) + "\n" + "".join(f"{k / 100},{k * 0.06},6.2,0.5,12,30,0\n" for k in range(300))

OTHERS = """
[[trial]]
name = "clamped"
kind = "dry"
motor = "logged.motor.csv"
commanded_hz = 0.8

[[trial]]
name = "logged"
kind = "swim"
motor = "logged.motor.csv"
commanded_hz = 0.8
"""


def with_others(folder: Path) -> Path:
    (folder / "logged.motor.csv").write_text(MOTOR_LOG)
    toml = folder / "session.toml"
    toml.write_text(toml.read_text() + OTHERS)
    return folder


def only(folder: Path, *names: str) -> Path:
    """Leaves these trials of the session."""
    head, *trials = (folder / "session.toml").read_text().split("[[trial]]")
    kept = [trial for trial in trials if any(f'name = "{name}"' in trial for name in names)]
    (folder / "session.toml").write_text("[[trial]]".join([head, *kept]))
    return folder


@pytest.mark.long
@pytest.mark.usefixtures("true_report")
def test_other_trials_are_left_out_with_a_note_that_says_why(calib: Front, fresh: Path) -> None:
    outcome = calib("run", with_others(fresh), "--effort", "quick", "--until", "fit", "--verbose")

    assert outcome.code == 0, outcome.err
    for name in ("clamped", "logged"):
        assert f"Trial {name} was left out: it has neither tracks nor a video." in outcome.out
    report = (fresh / "results" / "report.html").read_text()
    assert "Trial clamped was left out" in report


def test_a_session_with_nothing_to_fit_is_reported_so(calib: Front, fresh: Path) -> None:
    edit(fresh / "session.toml", 'role = "fit"', 'role = "holdout"')

    assert_reports(calib("run", fresh), 'no swim has role = "fit"')
    assert not (fresh / "results" / "calibration.json").exists()


@pytest.mark.long
@pytest.mark.usefixtures("true_report")
def test_without_held_out_trials_there_is_no_held_out_summary(calib: Front, fresh: Path) -> None:
    outcome = calib("run", only(fresh, "slow"), "--effort", "quick", "--until", "fit")

    assert outcome.code == 0, outcome.err
    assert "no trial is held out" in outcome.out
    assert calibration_of(fresh)["summary"]["holdout"] is None
    assert (fresh / "results" / "report.html").is_file()


def change_tracks(folder: Path, name: str, change: Callable[[np.ndarray], None]) -> None:
    """Changes the positions (n, m, 2) of a trial in place."""
    path = folder / "trials" / f"{name}.csv.gz"
    tracks = load_tracks(path, PLAN.markers, 60.0)
    change(pixels_of(tracks))
    confidence = np.isfinite(pixels_of(tracks)).all(axis=2).astype(float)
    plain = folder / "plain.csv"
    save_tracks(plain, changed(tracks, confidence=confidence))
    path.write_bytes(gzip.compress(plain.read_bytes(), mtime=0))
    plain.unlink()


def lose_the_tail(position_px: np.ndarray) -> None:
    position_px[8:, 3:] = np.nan


def test_the_only_fit_trial_whose_tail_cannot_be_trusted_is_named(calib: Front, fresh: Path) -> None:
    change_tracks(fresh, "slow", lose_the_tail)
    outcome = calib("run", fresh, "--effort", "quick", "--until", "fit")

    assert_reports(outcome, "trial slow:", "usable tail marker", "leave the trial out")
    assert set(files_in(fresh / "results")) <= {".stages.json", ".stages.lock", "tracks/slow.csv", "tracks/fast.csv"}


def test_one_recording_under_the_names_of_two_commands_is_used_for_neither(calib: Front, fresh: Path) -> None:
    edit(fresh / "session.toml", "trials/fast.csv.gz", "trials/slow.csv.gz")
    outcome = calib("run", fresh, "--effort", "quick", "--until", "fit")

    assert_reports(outcome, "trial slow: its recording is that of fast", "trial fast: its recording is that of slow")


@pytest.mark.parametrize("copied", [False, True])
@pytest.mark.parametrize("held_out_first", [False, True])
def test_of_one_recording_with_two_names_and_one_command_the_fit_trial_stays(
    fresh: Path, held_out_first: bool, copied: bool
) -> None:
    edit(fresh / "session.toml", "commanded_hz = 1.35", "commanded_hz = 0.82")
    again = "trials/again.csv.gz" if copied else "trials/slow.csv.gz"
    shutil.copy(fresh / "trials" / "slow.csv.gz", fresh / "trials" / "again.csv.gz")
    edit(fresh / "session.toml", "trials/fast.csv.gz", again)
    if held_out_first:
        head, *trials = (fresh / "session.toml").read_text().split("[[trial]]")
        (fresh / "session.toml").write_text("[[trial]]".join([head, *trials[::-1]]))
    recordings = Pipeline(open_session(fresh), Options()).recordings

    assert [trial.name for trial in recordings.swims] == ["slow"]
    assert recordings.swims_left_out == {"fast": "its recording is that of slow: give each its own, or remove one"}


@pytest.mark.parametrize("role", ["fit", "holdout"])
def test_a_swim_that_is_cut_from_a_fit_trial_is_flagged(fresh: Path, role: str) -> None:
    slow = load_tracks(fresh / "trials" / "slow.csv.gz", PLAN.markers, 60.0)
    save_tracks(fresh / "trials" / "cut.csv.gz", slow.isel(time=slice(6, None)))
    edit(fresh / "session.toml", "trials/fast.csv.gz", "trials/cut.csv.gz")
    edit(fresh / "session.toml", 'role = "holdout"', f'role = "{role}"')
    swims = {trial.name: trial for trial in Pipeline(open_session(fresh), Options()).recordings.swims}

    (told,) = (flag.message for flag in swims["fast"].flags if flag.kind == "shared_frames")
    assert f"frames are frames of slow, too: they {'are fitted twice' if role == 'fit' else 'were fitted'}" in told
    assert "shared_frames" not in {flag.kind for flag in swims["slow"].flags}


def lose_all(position_px: np.ndarray) -> None:
    position_px[:] = np.nan


@pytest.mark.parametrize(
    ("lose", "reason"),
    [(lose_all, "no marker is seen in any frame"), (lose_the_tail, "gap: caudal_fin is missing in")],
)
def test_a_trial_that_is_not_seen_stops_no_other_and_says_why(
    fresh: Path, lose: Callable[[np.ndarray], None], reason: str
) -> None:
    change_tracks(fresh, "fast", lose)
    recordings = Pipeline(open_session(fresh), Options()).recordings

    assert [trial.name for trial in recordings.swims] == ["slow"]
    assert reason in recordings.swims_left_out["fast"]


@pytest.mark.long
def test_a_held_out_trial_whose_tail_cannot_be_trusted_stops_no_other(calib: Front, fresh: Path) -> None:
    change_tracks(fresh, "fast", lose_the_tail)
    outcome = calib("run", fresh, "--effort", "quick", "--until", "fit")

    assert outcome.code == 0, outcome.err
    data = json.loads((fresh / "results" / "calibration.json").read_text())
    assert list(data["trials"]) == ["slow"]
    assert "usable tail marker" in data["left_out"]["fast"]
    assert next(flag["message"] for flag in data["flags"] if flag["kind"] == "left_out").startswith("fast is left out:")


@pytest.mark.long
def test_a_spoiled_film_stops_no_fit_of_the_others_and_is_flagged(calib: Front, filmed: Path) -> None:
    (filmed / "trials" / "fast.mp4").write_bytes(b"")
    outcome = calib("run", filmed, "--effort", "quick", "--until", "fit")

    assert outcome.code == 0, outcome.err
    data = calibration_of(filmed)
    assert list(data["trials"]) == ["slow"]
    assert data["left_out"]["fast"].startswith("fast.mp4: empty file")
    assert [flag["kind"] for flag in data["flags"] if "fast.mp4" in flag["message"]] == ["left_out"]


@pytest.mark.long
def test_a_session_whose_only_film_to_fit_is_spoiled_is_one_error_that_names_it(calib: Front, filmed: Path) -> None:
    (filmed / "trials" / "slow.mp4").write_bytes(b"\0" * 4000)

    assert_reports(calib("fit", filmed, "--effort", "quick"), "trial slow: slow.mp4: not a readable video")
    assert not (filmed / "results" / "calibration.json").exists()


def exchange_heads(content: dict[str, Any]) -> None:
    boxes = content["boxes"]
    boxes["nose"], boxes["neck"] = boxes["neck"], boxes["nose"]


@pytest.mark.long
def test_flagged_stretches_are_left_out_by_weight(calib: Front, fresh: Path) -> None:
    def freeze(position_px: np.ndarray) -> None:
        position_px[60:120, PLAN.markers.index("tail_5")] = position_px[60, PLAN.markers.index("tail_5")]

    change_tracks(fresh, "slow", freeze)
    outcome = calib("run", fresh, "--effort", "quick", "--until", "fit")

    assert outcome.code == 0, outcome.err
    used = load_tracks(fresh / "results" / "tracks" / "slow.csv", PLAN.markers, 60.0)
    column = PLAN.markers.index("tail_5")
    assert (used.confidence.values[70:110, column] == 0).mean() > 0.5
    assert np.delete(used.confidence.values, column, axis=1).mean() > 0.9


@pytest.mark.long
@pytest.mark.usefixtures("true_report")
def test_without_the_tail_tip_there_is_no_ebt_and_all_else_stands(calib: Front, fresh: Path) -> None:
    def lose_the_fin(position_px: np.ndarray) -> None:
        position_px[8:, PLAN.markers.index("caudal_fin")] = np.nan

    for name in ("slow", "fast"):
        change_tracks(fresh, name, lose_the_fin)
    outcome = calib("run", fresh, "--effort", "quick", "--until", "fit", "--verbose")

    assert outcome.code == 0, outcome.err
    assert "the last two markers of the tail are usable together in no fit trial" in outcome.out
    data = json.loads((fresh / "results" / "calibration.json").read_text())
    assert data["ebt"]["drag_coefficient"] is None
    assert data["trials"]["slow"]["speed_ebt"] is None
    assert data["trials"]["slow"]["speed_twin"] is not None
    assert (fresh / "results" / "report.html").is_file()


def test_exchanged_boxes_in_all_trials_are_one_error_that_names_each(calib: Front, filmed: Path) -> None:
    for name in ("slow", "fast"):
        change_boxes(filmed, name, exchange_heads)

    assert_reports(calib("fit", filmed), "trial slow: slow.boxes.json", "trial fast", "Exchange nose and neck")
