from functools import cache

import numpy as np
import pytest

from benchmarks.video.clips import BENCHMARK_CLIPS
from benchmarks.video.scene import PoolScene
from benchmarks.video.truth import ClipTruth

HIDDEN = 0.001  # share of a disc that is seen at most


@cache
def truth_of(name: str) -> ClipTruth:
    return PoolScene(BENCHMARK_CLIPS[name]).truth


@pytest.mark.parametrize("name", BENCHMARK_CLIPS)
@pytest.mark.long
def test_every_marker_is_seen_whole_in_the_first_frame(name: str) -> None:
    assert truth_of(name).visible[0].all()


@pytest.mark.parametrize(("name", "nearest_px"), [("clean_2_25hz", 18.0), ("neighbours_14px", 14.0)])
def test_neighbours_are_as_close_as_the_clip_says(name: str, nearest_px: float) -> None:
    truth = truth_of(name)
    apart = np.linalg.norm(truth.shown_px[:, :, None] - truth.shown_px[:, None], axis=3)  # (n, m, m)

    assert apart[:, ~np.eye(len(truth.markers), dtype=bool)].min() == pytest.approx(nearest_px, abs=0.1)
    assert truth.diameter_px.max() < nearest_px


@pytest.mark.long
def test_two_and_three_times_the_motion_are() -> None:
    speed = [
        np.linalg.norm(np.diff(truth_of(name).shown_px, axis=0), axis=2).max()
        for name in ("ripple", "motion_2x", "motion_3x")
    ]

    assert speed[1] / speed[0] == pytest.approx(2, rel=0.05)
    assert speed[2] / speed[0] == pytest.approx(3, rel=0.07)


def test_the_pole_hides_one_marker_for_fifteen_frames() -> None:
    hidden = truth_of("occlusion_15").visible_share < HIDDEN

    assert hidden.sum(axis=0).max() == 15
    assert (hidden.sum(axis=0) > 0).sum() == 1


def test_markers_leave_for_good_or_come_back() -> None:
    left = truth_of("leaves_picture").visible_share[:, 0] < HIDDEN
    assert left.sum() > 90
    assert left[-90:].all()

    caudal = truth_of("comes_and_goes").visible[:, -1]
    assert (np.diff(caudal.astype(int)) == 1).sum() >= 3
