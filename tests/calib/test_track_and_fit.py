"""From videos to a calibration in one command, interrupted or not; what stands on the terminal meanwhile."""

import os
import pty
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from rich.progress import Progress

from calib.pipeline import Pipeline, open_session
from calib.progress_bar import Lines, ProgressBar
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.tracks import pixels_of
from tests.calib.door import ROOT, Front, calibration_of, edit, results_in
from tests.calib.filmed import FRAMES, NAMES, PLAN, change_boxes, read, tracks_of, with_tracks
from tracking.tracker import MarkerTracker


def test_a_run_goes_from_video_to_report(calib: Front, filmed: Path) -> None:
    outcome = calib("run", filmed, "--effort", "quick", "--until", "fit")

    assert outcome.code == 0, outcome.err
    assert (filmed / "results" / "report.html").is_file()
    assert "! fast: the lens" not in calib("fit", filmed, "--effort", "quick", "-v").out  # it shows a good lens
    trials = calibration_of(filmed)["trials"]
    for trial in PLAN.trials:
        assert trials[trial.name]["frequency_hz"] == pytest.approx(trial.frequency_hz, abs=0.01)
    before = results_in(filmed)
    assert calib("run", filmed, "--effort", "quick", "--until", "fit").code == 0
    assert results_in(filmed) == before


@pytest.mark.long
def test_frames_before_the_boxes_are_tracked_backward_and_keep_their_numbers(filmed: Path) -> None:
    true = read(filmed / "truth" / "slow.csv")

    def later(content: dict[str, object]) -> None:
        content["frame"] = 12
        corners = pixels_of(true)[12] - 6.5
        content["boxes"] = {
            name: [*corner, 14, 14] for name, corner in zip(FISHSIM_MARKERS, corners.tolist(), strict=True)
        }

    change_boxes(filmed, "slow", later)
    edit(with_tracks(filmed, "fast") / "session.toml", "warmup_s = 1.0", "warmup_s = 0.5")
    Pipeline(open_session(filmed)).recordings.tracks()

    used = read(filmed / "results" / "tracks" / "slow.csv")
    np.testing.assert_allclose(used.time.values, true.time.values, atol=1e-3)
    assert (used.confidence.values[:12] > 0).mean() > 0.9
    assert np.nanmax(np.abs(pixels_of(used) - pixels_of(true))) < 0.5


@pytest.mark.long
def test_ctrl_c_in_the_middle_and_going_on_gives_the_same_tracks(
    calib: Front, filmed: Path, tracked_session: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    steps, stop_at = [0], [70]
    step = MarkerTracker.step

    def counted(tracker: MarkerTracker, *arguments: object, **options: object) -> object:
        steps[0] += 1
        if steps[0] == stop_at[0]:
            raise KeyboardInterrupt
        return step(tracker, *arguments, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(MarkerTracker, "step", counted)
    outcome = calib("track", filmed)

    assert outcome.code == 130
    assert "the same command goes on from there" in outcome.err
    raw = filmed / "results" / "tracking" / "raw"
    assert [path.name for path in raw.iterdir()] == [".slow.partial.npz"]
    steps[0], stop_at[0] = 0, -1
    assert calib("track", filmed).code == 0
    assert steps[0] == sum(FRAMES.values()) - 61 - 1  # the first frame of either is no step; sixty of slow stood
    assert not list(raw.glob(".*.npz"))
    for name in NAMES:
        for stage in ("", "raw"):
            whole, resumed = (tracks_of(folder, name, stage) for folder in (tracked_session, filmed))
            np.testing.assert_array_equal(pixels_of(whole), pixels_of(resumed))
            np.testing.assert_array_equal(whole.confidence.values, resumed.confidence.values)


@pytest.mark.long
def test_the_terminal_shows_frames_a_second_and_the_time_left(filmed: Path) -> None:
    ours, theirs = pty.openpty()
    command = [sys.executable, "-c", "from calib.cli import main; main()", "track", str(filmed)]
    environment = os.environ | {"COLUMNS": "200", "TERM": "xterm-256color"}
    running = subprocess.Popen(command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, stderr=theirs)
    os.close(theirs)
    shown = b""
    try:
        while part := os.read(ours, 65536):
            shown += part
    except OSError:  # the other end is closed
        pass
    out, _ = running.communicate(timeout=60)
    os.close(ours)

    assert running.returncode == 0
    assert b"tracking slow" in shown
    assert b"frames a second" in shown
    assert b"left" in shown
    assert b"tracking slow" not in out


def test_the_time_left_is_estimated_anew_for_each_stage() -> None:
    clock = [0.0]
    with Progress(get_time=lambda: clock[0], disable=True) as bar:
        tell = ProgressBar(bar, clock=lambda: clock[0])
        estimate = bar.tasks[0].fields["estimate"]
        for second in range(5):
            clock[0] = second
            tell("tracking slow", second / 4)
        assert estimate.left_s == 0
        tell("looking", None)
        for second in range(3):
            clock[0] = 10 + second
            tell("tracking fast", second / 8)
        assert estimate.left_s is None
        clock[0] = 14
        assert estimate.left_s == 12
        assert bar.tasks[0].elapsed == 14


def test_a_step_that_takes_long_is_reported_every_ten_seconds_too() -> None:
    clock, lines = [0.0], []
    tell = Lines(lines.append, clock=lambda: clock[0])
    tell("fitting", 0.0)
    for second in range(1, 36):
        clock[0] = second
        if second == 15:
            tell("fitting", 0.5)
        tell.tick()
    assert lines == [
        "calib: fitting",
        "calib: fitting, for 10 s",
        "calib: fitting, 50% done, about 20 s left",
        "calib: fitting, for 30 s, 50% done, about 30 s left",
    ]


def test_no_line_is_repeated_without_news_and_no_estimate_counts_down_to_nothing() -> None:
    clock, lines = [0.0], []
    tell = Lines(lines.append, clock=lambda: clock[0])
    for second in range(0, 21):
        clock[0] = second
        tell("fitting", second / 40)
    told = len(lines)
    for second in range(21, 600):  # it hangs
        clock[0] = second
        tell.tick()
    hung = lines[told:]
    assert len(set(lines)) == len(lines)
    assert len(hung) <= 12
    left = [float(line.split("about ")[1].split()[0]) * (60 if "min" in line else 1) for line in hung]
    assert left == sorted(left)
    assert left[-1] > 300


def test_a_step_of_unknown_length_says_how_long_it_has_taken_at_growing_intervals() -> None:
    clock, lines = [0.0], []
    tell = Lines(lines.append, clock=lambda: clock[0])
    tell("reading", None)
    for second in range(1, 130):
        clock[0] = second
        tell.tick()
    assert lines == ["calib: reading", *(f"calib: reading, for {seconds} s" for seconds in (20, 40, 80))]
