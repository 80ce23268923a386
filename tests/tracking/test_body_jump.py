"""A jump of the whole body keeps its shape: only its motion gives it away."""

import numpy as np
import pytest

from swimcal.robot import load_robot
from tests.tracking.fish import MARKERS, tracks_of
from tests.tracking.records.trials import twin_px
from tracking.body_jump import body_jumps
from tracking.quality import check_tracks


def swimming() -> np.ndarray:
    """(n, m, 2) a swim of the twin, px, with the noise of a tracker."""
    clean = twin_px()[1]
    return clean + np.random.default_rng(4).normal(0, 0.3, clean.shape)


def test_no_swim_jumps_by_itself() -> None:
    for clean in twin_px():
        assert body_jumps(np.arange(len(clean)) / 60, clean) == []


@pytest.mark.parametrize("shift_px", [(150, 0), (25, -15), (-9, 8)])
def test_a_bumped_camera_is_flagged_and_the_longer_part_counts(shift_px: tuple[int, int]) -> None:
    position = swimming()
    position[150:] += shift_px
    quality = check_tracks(tracks_of(position, MARKERS), load_robot())
    (flag,) = [flag for flag in quality.flags if flag.kind == "jump"]
    assert (flag.frames, flag.markers) == ((150, 150), MARKERS)
    assert (quality.weight[:150] > 0).mean() > 0.9
    assert not quality.weight[150:].any()


def test_frames_that_are_gone_without_a_trace_in_the_times_are_flagged() -> None:
    position = np.delete(swimming(), slice(100, 130), axis=0)
    assert [frame for frame, _ in body_jumps(np.arange(len(position)) / 60, position)] == [100]


@pytest.mark.parametrize("every", [2, 5, 9])
def test_frames_that_are_always_missing_after_so_many_are_told(every: int) -> None:
    kept = np.delete(swimming(), np.s_[every :: every + 1], axis=0)
    quality = check_tracks(tracks_of(kept, MARKERS), load_robot())
    (flag,) = [flag for flag in quality.flags if flag.kind == "jump"]
    assert "frames are missing in" in flag.message
    assert not quality.weight.any()


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("share", [0.01, 0.03, 0.1, 0.25])
def test_where_single_frames_are_missing_here_and_there_nothing_runs_too_fast(share: float, seed: int) -> None:
    """What counts of the trial takes the time that it took, to a frame in a hundred."""
    rng = np.random.default_rng(seed)
    for clean in twin_px():
        number = np.flatnonzero(rng.random(len(clean)) > share)
        position = (clean + rng.normal(0, 0.1, clean.shape))[number]
        quality = check_tracks(tracks_of(position, MARKERS), load_robot())
        counted = number[(quality.weight > 0).any(axis=1)]
        if len(counted):
            assert np.ptp(counted) + 1 <= 1.01 * len(counted)
        if share >= 0.1:
            assert not len(counted)


@pytest.mark.parametrize("lost", ["tail", "all"])
def test_a_cut_over_which_the_robot_is_lost_is_a_jump(lost: str) -> None:
    """The head is found again at once, or all of it after a while; where nothing is cut it is where it swam to."""
    position, head = swimming(), [MARKERS.index(name) for name in ("nose", "neck")]
    cut = np.delete(position, slice(100, 130), axis=0)
    for each in (position, cut):
        each[100:110, [k for k in range(len(MARKERS)) if lost == "all" or k not in head]] = np.nan
    jumps = []
    for each in (position, cut):
        flags = check_tracks(tracks_of(each, MARKERS), load_robot()).flags
        jumps.append([flag for flag in flags if flag.markers == MARKERS and flag.kind == "jump"])
    assert not jumps[0]
    (flag,) = jumps[1]
    assert flag.frames == ((100, 100) if lost == "tail" else (110, 110))


@pytest.mark.parametrize("missing", [1, 2, 5])
def test_single_frames_that_are_gone_are_found_where_the_robot_moves(missing: int) -> None:
    clean = twin_px()[1]
    position = clean + np.random.default_rng(4).normal(0, 0.1, clean.shape)
    step_px = np.sqrt((np.diff(clean, axis=0) ** 2).sum(axis=2).mean(axis=1))
    first = 60 + int(np.argmax(step_px[60:200]))
    gone = np.delete(position, slice(first, first + missing), axis=0)

    assert [frame for frame, _ in body_jumps(np.arange(len(gone)) / 60, gone)] == [first]
    repeated = position.copy()  # a picture that is late, and none that is gone
    repeated[first] = repeated[first - 1]
    assert body_jumps(np.arange(len(position)) / 60, repeated) == []


@pytest.mark.parametrize("missing", [4, 12])
@pytest.mark.parametrize("lost", [(), (3,)])
def test_frames_that_are_gone_are_found_though_the_head_is_clamped(missing: int, lost: tuple[int, ...]) -> None:
    time_s, rng = np.arange(200) / 60, np.random.default_rng(missing)
    reach = np.array([0.0, 0.0, 8.0, 60.0, 90.0])
    sway = reach * np.sin(2 * np.pi * 1.4 * time_s[:, None] - 0.3 * np.arange(5))
    position = np.stack([np.broadcast_to(80.0 * np.arange(5), sway.shape), 200 + sway], axis=2)
    position += rng.normal(0, 0.1, position.shape)
    assert body_jumps(time_s, position) == []
    gone = np.delete(position, slice(104, 104 + missing), axis=0)
    gone[104:112, list(lost)] = np.nan
    assert [frame for frame, _ in body_jumps(time_s[: len(gone)], gone)] == [104]


@pytest.mark.parametrize("frames", [5.5, 6.6, 9.0, 14.0])
@pytest.mark.parametrize("start_s", [0.0, 0.7])
def test_a_row_that_is_shaken_as_a_whole_lacks_no_frame(frames: float, start_s: float) -> None:
    time_s = np.arange(160) / 60
    since = np.clip(time_s - start_s, 0, None)
    shaken = 60.0 * np.minimum(since, 1.0) * np.sin(2 * np.pi * 60 / frames * since)
    position = np.stack([shaken[:, None] + 80.0 * np.arange(7), np.full((160, 7), 200.0)], axis=2)
    position += np.random.default_rng(0).normal(0, 0.1, position.shape)
    assert [frame for frame, off_px in body_jumps(time_s, position) if not off_px] == []


@pytest.mark.parametrize("hz", [0.5, 1.3, 2.4])
@pytest.mark.parametrize("softly", [False, True])
def test_a_start_from_rest_is_no_gap(hz: float, softly: bool) -> None:
    time_s = np.arange(200) / 60
    since = np.clip(time_s - 1.2, 0, None)[:, None]
    grown = 1 - np.exp(-3 * since) if softly else np.ones_like(since)
    sway = np.array([0.0, 0.0, 60.0, 90.0]) * grown * np.sin(2 * np.pi * hz * since)
    position = np.stack([np.broadcast_to(80.0 * np.arange(4), sway.shape), 200 + sway], axis=2)
    position += np.random.default_rng(0).normal(0, 0.1, position.shape)
    assert body_jumps(time_s, position) == []


def test_a_gap_that_the_times_tell_of_is_no_jump() -> None:
    kept = np.delete(np.arange(len(swimming())), slice(100, 130))
    assert body_jumps(kept / 60, swimming()[kept]) == []
