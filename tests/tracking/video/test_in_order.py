"""Every frame comes once, in order of presentation, with its own time."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.tracking.video.clips import CLIPS, GOP, Clip, number_in
from tracking.decoding import TimeSource
from tracking.video import Video


@pytest.mark.parametrize("name", CLIPS)
def test_every_frame_comes_once_in_order_of_presentation(name: str, clip: Callable[[str], Path]) -> None:
    with Video(clip(name)) as video:
        frames = [(frame.number, number_in(frame.luma), frame.time_s) for frame in video.frames()]
        assert [number for number, _, _ in frames] == list(range(40))
        assert [shown for _, shown, _ in frames] == list(range(40))
        np.testing.assert_array_equal([time_s for _, _, time_s in frames], video.info.time_s)
        assert video.damage is None


@pytest.mark.parametrize("name", sorted(CLIPS.keys() - {"h264-raw"}))
def test_times_are_those_that_were_written(name: str, clip: Callable[[str], Path]) -> None:
    with Video(clip(name)) as video:
        np.testing.assert_allclose(video.info.time_s, np.arange(40) / 30, atol=0.6e-3)  # Matroska rounds to 1 ms
        assert (video.info.width_px, video.info.height_px, video.info.frames) == (160, 96, 40)
        assert video.info.fps == pytest.approx(30, rel=1e-3)


@pytest.mark.parametrize(("suffix", "codec"), [(".mp4", "libx264"), (".mov", "libx264"), (".mkv", "ffv1")])
def test_variable_frame_rate_keeps_each_time(suffix: str, codec: str, tmp_path: Path) -> None:
    stamps_ms = np.cumsum(np.random.default_rng(3).integers(5, 120, 50))
    stamps_ms -= stamps_ms[0]
    path = Clip(suffix, codec, frames=50, stamps_ms=[int(t) for t in stamps_ms], options={"g": "10"}).write(tmp_path)
    with Video(path) as video:
        np.testing.assert_allclose([frame.time_s for frame in video.frames()], stamps_ms / 1000, atol=1e-6)
        assert [number_in(frame.luma) for frame in video.frames()] == list(range(50))


@pytest.mark.parametrize("first", [-7, 25])
def test_first_frame_is_at_zero_wherever_the_stamps_begin(first: int, tmp_path: Path) -> None:
    path = Clip(".mkv", "libx264", first=first, options=GOP).write(tmp_path)
    with Video(path) as video:
        np.testing.assert_allclose(video.info.time_s, np.arange(40) / 30, atol=1.1e-3)
        assert [number_in(frame.luma) for frame in video.frames()] == list(range(40))


def test_frames_cut_off_by_an_edit_list_are_not_counted(tmp_path: Path) -> None:
    path = Clip(".mp4", "libx264", first=-7, options=GOP, container={"avoid_negative_ts": "disabled"}).write(tmp_path)
    with Video(path) as video:
        assert [number_in(frame.luma) for frame in video.frames()] == list(range(7, 40))
        assert [number_in(video.frame(number).luma) for number in (0, 20, 5, 32)] == [7, 27, 12, 39]
        assert video.info.time_s[0] == 0
        assert video.damage is None


def test_a_file_without_times_says_where_they_come_from(clip: Callable[[str], Path]) -> None:
    with Video(clip("h264-raw")) as raw, Video(clip("h264-avi-b-frames")) as avi, Video(clip("h264-mp4")) as mp4:
        assert raw.info.time_source is TimeSource.FRAME_RATE
        assert raw.info.caveats == ()  # nobody tracks it without telling its rate
        assert "times come from decoding time stamps" in avi.info.caveats[0]
        assert mp4.info.caveats == ()
