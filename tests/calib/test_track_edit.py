"""`calib edit`: a person's corrections are logged, replayed by `calib track`, and can be taken back."""

import json
import shlex
from pathlib import Path

import numpy as np
import pytest

from calib.pipeline import Pipeline, open_session
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.tracks import pixels_of
from tests.calib.door import Front, assert_reports, calibration_of, edit
from tests.calib.filmed import read, tracks_of, with_tracks
from tracking.tracked import SampleState, load_tracked

A, B = FISHSIM_MARKERS.index("tail_3"), FISHSIM_MARKERS.index("tail_4")
SWAP = '{"op": "swap", "markers": ["tail_3", "tail_4"], "frames": [20, 30]}'
DROP = '{"op": "drop", "markers": ["tail_3"], "frames": [10, 60]}'


def raw_files(folder: Path) -> dict[str, bytes]:
    """The tracks as the tracker left them, to the bit."""
    return {path.name: path.read_bytes() for path in (folder / "results" / "tracking" / "raw").iterdir()}


def states(folder: Path) -> np.ndarray:
    return load_tracked(folder / "results" / "tracking", "slow").state


def flags(folder: Path) -> list[str]:
    content = json.loads((folder / "results" / "tracking" / "slow.flags.json").read_text())
    return [flag["kind"] for flag in content]


def test_a_swap_is_replayed_and_the_raw_tracks_stay(calib: Front, tracked: Path) -> None:
    before, raw = pixels_of(tracks_of(tracked, "slow")), raw_files(tracked)
    outcome = calib("edit", tracked, "slow", SWAP)

    log = tracked / "trials" / "slow.edits.jsonl"
    assert (outcome.code, outcome.err) == (0, "")
    assert f"{log}: added line 1; 1 edit counts" in outcome.out
    back = f"""calib edit {tracked} slow '{{"op": "undo", "line": 1}}'"""
    assert f"`{back}` takes this back" in outcome.out
    assert calib("track", tracked).code == 0
    after = pixels_of(tracks_of(tracked, "slow"))
    expected = before.copy()
    expected[20:31, [A, B]] = before[20:31, [B, A]]
    np.testing.assert_array_equal(after, expected)
    assert raw_files(tracked) == raw
    assert "edited" in flags(tracked)


@pytest.mark.long
def test_a_swap_that_makes_it_worse_is_flagged_and_counts_nowhere(calib: Front, tracked: Path) -> None:
    calib("edit", tracked, "slow", SWAP)

    assert "swap" in calib("track", tracked).out.splitlines()[1]
    Pipeline(open_session(tracked)).recordings.tracks()
    used = read(tracked / "results" / "tracks" / "slow.csv")
    assert (used.confidence.values[20:31, [A, B]] == 0).all()
    assert used.confidence.values[40:, [A, B]].min() > 0
    reported = json.loads(calib("track", tracked, "--json").out)["slow"]
    assert reported["counts"] == np.mean(used.confidence.values > 0) < reported["seen"] == 1.0


@pytest.mark.long
def test_a_box_is_tracked_on_from(calib: Front, tracked: Path) -> None:
    before = pixels_of(tracks_of(tracked, "slow"))
    calib("edit", tracked, "slow", DROP)
    x, y = (np.round(before[15, A]) - 5).tolist()
    box = {"op": "box", "marker": "tail_3", "frame": 15, "box": [x, y, 11, 11], "until": 40}
    assert calib("edit", tracked, "slow", json.dumps(box)).code == 0
    assert calib("track", tracked).code == 0

    after, state = pixels_of(tracks_of(tracked, "slow")), states(tracked)
    assert state[15, A] == SampleState.BY_HAND
    assert (state[16:41, A] == SampleState.MEASURED).all()
    assert np.abs(after[16:41, A] - before[16:41, A]).max() < 0.5
    assert (state[41:61, A] == SampleState.MISSING).any()


@pytest.mark.long
def test_a_fit_takes_an_edit_into_account_by_itself(calib: Front, fitted: Path) -> None:
    before = calibration_of(fitted)
    calib("edit", fitted, "slow", DROP)
    assert calib("fit", fitted, "--effort", "quick").code == 0

    after = calibration_of(fitted)
    assert after["trials"]["slow"]["used_fraction"] < before["trials"]["slow"]["used_fraction"]
    assert "trials/slow.edits.jsonl" in after["inputs"]


WATER = '{"op": "box", "marker": "tail_3", "frame": 15, "box": [2, 2, 11, 11], "until": 40}'
CASES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "not JSON": (("slow", "{op: swap}"), ("the edit", "not JSON", '{"op": "drop"')),
    "frame beyond": (("slow", SWAP.replace("30", "85")), ("no such frame", "85", "0 to 84")),
    "box on water": (("slow", WATER), ("frame 15: boxes without a marker", "found tail_3", "calib view")),
    "unknown trial": (("slwo", SWAP), ("no such trial", "'slwo'", "slow, fast")),
    "no video": (("fast", SWAP), ("trial fast: it has no video", "choices: slow")),
}


@pytest.mark.parametrize("case", CASES)
def test_an_edit_that_does_not_fit_is_refused_and_nothing_written(calib: Front, tracked: Path, case: str) -> None:
    arguments, parts = CASES[case]
    with_tracks(tracked, "fast")

    assert_reports(calib("edit", tracked, *arguments), *parts)
    assert not list((tracked / "trials").glob("*.jsonl"))


def test_a_marker_that_no_picture_shows_is_placed_by_hand_in_a_single_frame(calib: Front, tracked: Path) -> None:
    assert calib("edit", tracked, "slow", WATER.replace("40", "15")).code == 0


def test_an_edit_is_taken_back_by_the_command_that_its_outcome_names(calib: Front, tracked: Path) -> None:
    outcome = calib("edit", tracked, "slow", SWAP)
    _, *command = shlex.split(outcome.out.split("`")[-2])
    assert "added line 2; 0 edits count" in calib(*command).out


def test_a_fit_from_before_an_edit_names_the_edited_trial(calib: Front, fitted: Path) -> None:
    calib("edit", fitted, "slow", DROP)
    change = "from before a change of trials/slow.edits.jsonl (tracks of slow, edited by hand); expected"
    assert_reports(calib("report", fitted), "the fit is out of date", change)


def test_a_trial_with_both_tracks_and_video_is_not_edited(calib: Front, tracked: Path) -> None:
    edit(tracked / "session.toml", 'video = "trials/fast.mp4"', 'tracks = "truth/fast.csv"\nvideo = "trials/fast.mp4"')

    assert_reports(calib("edit", tracked, "fast", SWAP), "its tracks come from a file")
