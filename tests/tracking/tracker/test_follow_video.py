"""From a video to tracks: rows, states, interruption and going on, damage, and what is kept in between."""

import sys
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
import xarray as xr

from swimcal.errors import InputError
from swimcal.tracks import markers_of, pixels_of
from tests.cases import later
from tests.tracking.records.trials import same
from tests.tracking.tracker.pool import WATER, Pool, Thing, tail
from tracking.boxes import Box, StartBoxes
from tracking.csrt import SecondOpinion
from tracking.follow_video import PREDICTED_FOR, TRACKERS, Partial, follow_video
from tracking.tracked import SampleState
from tracking.video import Frame, Video

NAMES = ("tail_1", "tail_2", "tail_3", "tail_4")
FRAMES = 75
COVERED = (50, 66)  # a snapshot is taken while the marker is lost
PATH = tail(1.5, 20, 0.6, 4, (60, 60))
POOL = Pool(PATH, (180, 120), things=(Thing(lambda f: PATH(f)[1], (22.0, 22.0), WATER, COVERED),))


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return POOL.video(tmp_path_factory.mktemp("clip") / "clip.mkv", FRAMES)


@pytest.fixture(scope="module")
def whole(clip: Path) -> xr.Dataset:
    return tracked(clip)


def tracked(clip: Path, boxes: StartBoxes | None = None, **options: object) -> xr.Dataset:
    with Video(clip) as video:
        return follow_video(video, boxes or POOL.boxes(NAMES), NAMES, **options)  # type: ignore[arg-type]


class Interrupting:
    """A progress that is called after every frame and presses Ctrl-C after one of them."""

    def __init__(self, after: int, monkeypatch: pytest.MonkeyPatch) -> None:
        self.after = after
        monkeypatch.setattr(sys.modules["tracking.follow_video"], "_REPORT_EVERY_S", -1.0)
        self.progress: list[tuple[int, int, float]] = []

    def __call__(self, done: int, frames: int, fps: float) -> None:
        self.progress.append((done, frames, fps))
        if done == self.after:
            raise KeyboardInterrupt


def test_a_clip_is_tracked_to_a_fraction_of_a_pixel_at_its_own_times(whole: xr.Dataset, clip: Path) -> None:
    truth = POOL.truths(FRAMES)
    seen = whole.state.values == SampleState.MEASURED
    away = np.linalg.norm(pixels_of(whole) - truth, axis=2)
    clear = np.ones(FRAMES, bool)
    clear[COVERED[0] : COVERED[1] + 1] = False
    assert seen[clear][1:].all()
    assert away[clear].max() < 0.3
    with Video(clip) as video:
        assert np.array_equal(whole.time.values, video.info.time_s)
    assert markers_of(whole) == NAMES


def test_an_unseen_marker_is_predicted_for_a_while_and_then_missing(whole: xr.Dataset) -> None:
    state = whole.state.values[:, 1]
    first, last = COVERED
    assert (state[first : first + PREDICTED_FOR] == SampleState.PREDICTED).all()
    assert (state[first + PREDICTED_FOR : last + 1] == SampleState.MISSING).all()
    assert (state[last + 2 :] == SampleState.MEASURED).all()
    assert np.isnan(pixels_of(whole)[first + PREDICTED_FOR : last + 1, 1]).all()
    assert (whole.confidence.values[first : last + 1, 1] == 0).all()
    assert np.isnan(whole["size"].values[first : last + 1, 1]).all()


def test_frames_before_the_boxes_are_tracked_backward(clip: Path, whole: xr.Dataset) -> None:
    trial = tracked(clip, POOL.boxes(NAMES, 20))
    assert (trial.state.values[:35] == SampleState.MEASURED).all()
    assert np.abs(pixels_of(trial) - pixels_of(whole))[:20].max() < 1.0
    assert len(trial.state.values) == FRAMES


def test_plain_csrt_has_no_samples_before_the_boxes(clip: Path) -> None:
    trial = tracked(clip, POOL.boxes(NAMES, 70), method="csrt")
    assert (trial.state.values[:70] == SampleState.MISSING).all()


@pytest.mark.parametrize("after", [*later(31), 62, *later(74)])
@pytest.mark.parametrize("method", ["hybrid", "spots"])
def test_interrupted_work_goes_on_to_the_same_bits(
    clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, after: int, method: str
) -> None:
    """In the middle of a loss too; and a second time."""
    reference = tracked(clip, method=method)
    partial = Partial(tmp_path / "f1.partial.npz", "one")
    for stop in (after, after + 1):
        with pytest.raises(KeyboardInterrupt):
            tracked(clip, method=method, partial=partial, progress=Interrupting(stop, monkeypatch))
        assert partial.path.exists()
        assert list(tmp_path.iterdir()) == [partial.path]
    resumed = Interrupting(10**6, monkeypatch)
    assert same(tracked(clip, method=method, partial=partial, progress=resumed), reference)
    assert resumed.progress[0][0] > 30
    assert not partial.path.exists()


def test_the_threads_of_the_video_are_the_trackers_and_change_nothing(
    clip: Path, monkeypatch: pytest.MonkeyPatch, whole: xr.Dataset
) -> None:
    asked: list[int] = []
    before = cv2.getNumThreads()

    class Watched(SecondOpinion):
        def __init__(self, threads: int = 0) -> None:
            asked.extend([threads, cv2.getNumThreads()])
            super().__init__(threads)

    monkeypatch.setattr(sys.modules["tracking.tracker"], "SecondOpinion", Watched)
    with Video(clip, threads=1) as video:
        trial = follow_video(video, POOL.boxes(NAMES), NAMES)
    assert asked == [1, 1]
    assert cv2.getNumThreads() == before
    assert same(trial, whole)


@pytest.mark.long
def test_what_was_kept_under_another_fingerprint_is_not_used(
    clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, whole: xr.Dataset
) -> None:
    partial = Partial(tmp_path / "partial.npz", "one")
    with pytest.raises(KeyboardInterrupt):
        tracked(clip, POOL.boxes(NAMES, 3), partial=partial, progress=Interrupting(60, monkeypatch))
    started = Interrupting(10**6, monkeypatch)
    assert same(tracked(clip, partial=Partial(partial.path, "another"), progress=started), whole)
    assert started.progress[0][0] == 2


def test_a_partial_file_with_flipped_bytes_is_not_used(tmp_path: Path) -> None:
    partial = Partial(tmp_path / "partial.npz", "one")
    partial.write({"values": np.arange(1000)})
    whole = partial.path.read_bytes()
    for at in range(0, len(whole), 61):
        partial.path.write_bytes(whole[:at] + bytes([whole[at] ^ 0x40]) + whole[at + 1 :])
        read = partial.read()
        assert read is None or np.array_equal(read.get("values", []), np.arange(1000))


def test_an_unknown_method_is_refused_with_the_choices(clip: Path) -> None:
    with pytest.raises(ValueError, match=f"no tracker 'kcf'; choices: {', '.join(TRACKERS)}"):
        tracked(clip, method="kcf")


def test_boxes_in_a_frame_that_is_not_there_are_refused(clip: Path) -> None:
    boxes = POOL.boxes(NAMES)
    with pytest.raises(InputError, match="no such frame"):
        tracked(clip, StartBoxes(FRAMES + 10, boxes.boxes))


@pytest.mark.long
def test_the_baseline_follows_easy_markers_to_a_pixel_or_two(tmp_path: Path) -> None:
    pool = POOL.but(things=())
    trial = tracked(pool.video(tmp_path / "easy.mkv", 12), pool.boxes(NAMES), method="csrt")
    away = np.linalg.norm(pixels_of(trial) - pool.truths(12), axis=2)
    assert (trial.state.values == SampleState.MEASURED).all()
    assert away.max() < 4


class Holed(Video):
    """A video of which some frames cannot be decoded."""

    LOST = (12, 13, 14, 40, 60)

    @property
    def damage(self) -> str | None:
        return f"{len(self.LOST)} of {self.info.frames} frames cannot be decoded"

    def frames(self, start: int = 0, stop: int | None = None) -> Iterator[Frame]:
        return (frame for frame in super().frames(start, stop) if frame.number not in self.LOST)


def test_unreadable_frames_are_rows_without_samples_and_the_trial_reports_it(clip: Path) -> None:
    with Holed(clip) as video:
        trial = follow_video(video, POOL.boxes(NAMES), NAMES)
    readable = np.setdiff1d(np.arange(FRAMES), Holed.LOST)
    away = np.linalg.norm(pixels_of(trial) - POOL.truths(FRAMES), axis=2)
    others = [0, 2, 3]  # never covered
    assert len(trial.state.values) == FRAMES
    assert (trial.state.values[list(Holed.LOST)] == SampleState.MISSING).all()
    assert (trial.state.values[readable][:, others] == SampleState.MEASURED).all()
    assert away[readable][:, others][-10:].max() < 0.3
    assert [flag.message for flag in trial.flags if flag.kind == "damaged_video" and flag.frames is None] == [
        "5 of 75 frames cannot be decoded"
    ]


def test_a_cut_off_video_is_tracked_as_far_as_it_goes(clip: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mkv"
    content = clip.read_bytes()
    cut.write_bytes(content[: len(content) * 2 // 3])
    trial = tracked(cut)
    assert 30 < len(trial.state.values) < FRAMES
    assert (trial.state.values[:35] == SampleState.MEASURED).all()
    assert "damaged_video" in {flag.kind for flag in trial.flags}


def test_only_csrt_is_flagged_where_no_spot_answers(tmp_path: Path) -> None:
    def contrast(frame: float) -> np.ndarray:
        return np.array([110.0, 27.0 if 10 <= frame <= 20 else 110.0, 110.0, 110.0])

    pool = Pool(tail(1.5, 30, 0.6, 4, (40, 60)), (180, 120), contrast=contrast, texture=1.0)
    trial = tracked(pool.video(tmp_path / "faint.mkv", 30), pool.boxes(NAMES))
    flags = [(flag.kind, flag.markers, flag.frames) for flag in trial.flags]
    assert flags == [("only_csrt", ("tail_2",), (10, 13))]


def test_boxes_within_their_markers_are_told_so(clip: Path) -> None:
    boxes = POOL.boxes(NAMES)
    for name, box in boxes.boxes.items():
        boxes.boxes[name] = Box.around(box.centre_px, 4.0)
    with pytest.raises(InputError, match=r"The boxes of 4 px seem to lie within discs of 1\d px: draw each around"):
        tracked(clip, boxes)


def test_a_box_on_empty_water_is_refused_by_name(clip: Path) -> None:
    boxes = POOL.boxes(NAMES)
    boxes.boxes["tail_3"] = Box(150, 20, 18, 18)
    with pytest.raises(InputError, match="without a marker; found tail_3; expected a disc"):
        tracked(clip, boxes)
