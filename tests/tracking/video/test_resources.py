"""Reading holds one frame at a time, however long the video, and closes its files."""

import weakref
from collections.abc import Callable
from pathlib import Path

import av
import pytest

from swimcal.errors import InputError
from tests.tracking.video.clips import Clip
from tracking.video import Video


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[av.container.InputContainer]:
    """Every container that is opened for reading from here on; clips may still be written."""
    containers = []
    really_open = av.open

    def watched(*arguments: object, **named: object) -> object:
        container = really_open(*arguments, **named)
        if isinstance(container, av.container.InputContainer):
            containers.append(container)
        return container

    monkeypatch.setattr("tracking.decoding.av.open", watched)
    return containers


def is_closed(container: av.container.InputContainer) -> bool:
    try:
        container.seek(0)
    except AssertionError:
        return True
    return False


def test_frames_alive_do_not_grow_with_length(tmp_path: Path) -> None:
    alive: weakref.WeakSet[object] = weakref.WeakSet()
    most = 0
    with Video(Clip(".mp4", "libx264", frames=400).write(tmp_path)) as video:
        for frame in video.frames():
            assert frame.luma.size
            alive.add(frame)
            most = max(most, len(alive))
    assert most <= 2


def test_leaving_the_video_closes_what_random_access_opened(
    clip: Callable[[str], Path], opened: list[av.container.InputContainer]
) -> None:
    with Video(clip("h264-mp4")) as video:
        video.frame(20)
        video.frame(4)
        assert not all(map(is_closed, opened))
    assert all(map(is_closed, opened))


def test_a_file_that_is_refused_is_closed(tmp_path: Path, opened: list[av.container.InputContainer]) -> None:
    path = Clip(".mkv", "ffv1", frames=2, options={"g": "1"}).write(tmp_path)
    data = path.read_bytes()
    with av.open(str(path)) as container:
        first = next(packet for packet in container.demux(video=0) if packet.size)
        path.write_bytes(data[: data.index(bytes(first)) + 20])
    with pytest.raises(InputError, match="no frame of this video can be decoded"):
        Video(path)
    assert len(opened) == 2  # the test's, and the reader's
    assert is_closed(opened[1])
