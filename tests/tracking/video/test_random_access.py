"""A frame is the same picture under the same number, however it is reached."""

from collections.abc import Callable
from pathlib import Path

import av
import numpy as np
import pytest

from swimcal.errors import InputError
from tests.tracking.video.clips import CLIPS, number_in
from tracking.video import Video


@pytest.mark.parametrize("name", CLIPS)
def test_random_access_gives_the_frames_of_reading_in_order(name: str, clip: Callable[[str], Path]) -> None:
    with Video(clip(name)) as video:
        in_order = {frame.number: frame.luma.copy() for frame in video.frames()}
        for number in np.random.default_rng(7).permutation(40):
            frame = video.frame(int(number))
            assert frame.number == number
            np.testing.assert_array_equal(frame.luma, in_order[int(number)])


@pytest.mark.parametrize(
    "name", ["h264-mp4", "h264-mkv-open-gop", "h264-ts", "hevc-mp4-open-gop", "mpeg4-avi-b-frames"]
)
@pytest.mark.parametrize(("start", "stop"), [(0, 40), (13, 40), (23, 25), (39, 40), (0, 1), (17, 17)])
def test_a_range_begins_and_ends_where_asked(name: str, start: int, stop: int, clip: Callable[[str], Path]) -> None:
    with Video(clip(name)) as video:
        frames = list(video.frames(start, stop))
        assert [frame.number for frame in frames] == list(range(start, stop))
        assert [number_in(frame.luma) for frame in frames] == list(range(start, stop))


def test_a_container_that_cannot_seek_is_read_from_its_start(
    clip: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    really_open = av.open

    class Unseekable:
        def __init__(self, file: str) -> None:
            self._container = really_open(file)

        def __getattr__(self, name: str) -> object:
            return getattr(self._container, name)

        def seek(self, *_: object, **__: object) -> None:
            raise av.error.PermissionError(1, "Operation not permitted")

    monkeypatch.setattr("tracking.decoding.av.open", Unseekable)
    with Video(clip("h264-mp4")) as video:
        assert [number_in(video.frame(number).luma) for number in (30, 11, 39)] == [30, 11, 39]


@pytest.mark.parametrize("number", [-1, 40, 1000])
def test_a_frame_outside_the_video_is_refused(number: int, clip: Callable[[str], Path]) -> None:
    with Video(clip("h264-mp4")) as video, pytest.raises(InputError) as refused:
        video.frame(number)
    assert f"no such frame in this video; found frame {number}; expected frames 0 to 39" in str(refused.value)


@pytest.mark.parametrize(("start", "stop"), [(-1, 5), (5, 41), (9, 8)])
def test_a_range_outside_the_video_is_refused_before_reading(
    start: int, stop: int, clip: Callable[[str], Path]
) -> None:
    with Video(clip("h264-mp4")) as video, pytest.raises(InputError, match=f"frames {start} to {stop}"):
        video.frames(start, stop)
