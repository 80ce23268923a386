"""A marker set by hand is tracked on from there, and takes nothing that belongs to another."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from swimcal.tracks import as_tracks, pixels_of
from tests.tracking.tracker.pool import Pool, tail
from tracking.boxes import Box
from tracking.edits import EditLog, LoggedEdit, SetBox, apply_edits
from tracking.follow_video import retracker
from tracking.tracked import SampleState, as_tracked
from tracking.video import Video

NAMES = ("tail_1", "tail_2", "tail_3", "tail_4")
FRAMES, SET = 40, 10
PATH = tail(1.5, 20, 0.6, 4, (60, 60))
POOL = Pool(PATH, (180, 120))
TRUTH = POOL.truths(FRAMES)


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return POOL.video(tmp_path_factory.mktemp("clip") / "clip.mkv", FRAMES)


def spoiled() -> xr.Dataset:
    """Right for all but tail_3, which sits on its neighbour from frame 5 on."""
    position = TRUTH.copy()
    position[5:, 2] = position[5:, 1]
    return as_tracked(as_tracks(NAMES, np.arange(FRAMES) / 60, position, np.full((FRAMES, 4), 0.9)))


def box_at(place: np.ndarray, side: float = 18.0) -> tuple[float, float, float, float]:
    box = Box.around(place.tolist(), side)
    return box.x, box.y, box.width, box.height


def set_by_hand(video: Video, box: tuple[float, float, float, float], until: int | None = None) -> xr.Dataset:
    edit = SetBox(marker="tail_3", frame=SET, box=box, until=until)
    return apply_edits(
        spoiled(), EditLog(Path("f1.edits.jsonl"), NAMES, FRAMES, (LoggedEdit(1, edit),)), retracker(video)
    )


def test_a_marker_set_by_hand_is_tracked_on_to_the_end(clip: Path) -> None:
    with Video(clip) as video:
        trial = set_by_hand(video, box_at(TRUTH[SET, 2] + [3.0, -2.0]), None)
    away = np.linalg.norm(pixels_of(trial) - TRUTH, axis=2)[SET + 1 :, 2]
    assert (trial.state.values[SET + 1 :, 2] == SampleState.MEASURED).all()
    assert away.max() < 0.3
    assert np.isfinite(trial["size"].values[SET + 1 :, 2]).all()


def test_a_marker_that_sits_where_the_person_put_this_one_is_not_heeded(clip: Path) -> None:
    """The person is believed: whose spot it really is only they can see."""
    with Video(clip) as video:
        trial = set_by_hand(video, box_at(TRUTH[SET, 1]), None)
    onto = np.linalg.norm(pixels_of(trial)[:, 2] - TRUTH[:, 1], axis=1)[SET + 1 :]
    assert onto.max() < 0.3


def test_where_it_is_not_seen_it_is_missing_and_takes_no_spot_of_another(tmp_path: Path) -> None:
    def contrast(frame: float) -> np.ndarray:
        return np.array([110.0, 110.0, 0.0 if 20 <= frame <= 26 else 110.0, 110.0])

    pool = POOL.but(contrast=contrast, texture=1.0)
    with Video(pool.video(tmp_path / "clip.mkv", FRAMES)) as video:
        trial = set_by_hand(video, box_at(TRUTH[SET, 2]), None)
    assert (trial.state.values[20:27, 2] == SampleState.MISSING).all()
    assert np.isnan(pixels_of(trial)[20:27, 2]).all()
    assert (trial.confidence.values[20:27, 2] == 0).all()
    assert (trial.state.values[SET + 1 : 20, 2] == SampleState.MEASURED).all()
    back = np.linalg.norm(pixels_of(trial) - TRUTH, axis=2)[-5:, 2]
    assert back.max() < 0.3


def test_from_a_box_on_empty_water_nothing_is_followed_and_a_flag_reports_it(clip: Path) -> None:
    with Video(clip) as video:
        trial = set_by_hand(video, box_at(np.array([150.0, 20.0])), 25)
    assert (trial.state.values[SET + 1 : 26, 2] == SampleState.MISSING).all()
    assert (trial.state.values[26:, 2] == SampleState.MEASURED).all()
    assert [(flag.kind, flag.markers, flag.frames) for flag in trial.flags[1:]] == [
        ("doubtful_box", ("tail_3",), (SET, SET))
    ]


@pytest.mark.parametrize("until", [SET, 25, FRAMES - 1])
def test_it_is_tracked_on_up_to_the_last_frame_asked_for_and_all_else_stays(clip: Path, until: int) -> None:
    before = spoiled()
    with Video(clip) as video:
        after = set_by_hand(video, box_at(TRUTH[SET, 2]), until)
    away = np.linalg.norm(pixels_of(after) - TRUTH, axis=2)[:, 2]
    assert after.state.values[SET, 2] == SampleState.BY_HAND
    assert away[SET : until + 1].max() < 0.3
    same = np.ones((FRAMES, 4), bool)
    same[SET : until + 1, 2] = False
    assert np.array_equal(pixels_of(after)[same], pixels_of(before)[same])
    assert np.array_equal(after.confidence.values[same], before.confidence.values[same])
    assert [flag.kind for flag in after.flags] == ["edited"]
