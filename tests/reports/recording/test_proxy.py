"""A proxy shows the same pictures at the same times, in fewer pixels."""

from __future__ import annotations

import os
import struct
from pathlib import Path
from typing import NamedTuple

import av
import numpy as np
import pytest

from benchmarks.video import VideoWriter
from reports.recording import make_proxy
from session import InputError
from tests.reports.recording.trials import BODY, FRAMES, HEIGHT_PX, WIDTH_PX, frame_times_s, positions_px, write_video


class Decoded(NamedTuple):
    codec: str
    time_s: np.ndarray
    images: list[np.ndarray]
    keys: list[int]


@pytest.fixture(scope="module")
def video(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_video(tmp_path_factory.mktemp("video") / "video.mp4", (2 * WIDTH_PX, 2 * HEIGHT_PX))


def decoded(path: Path) -> Decoded:
    with av.open(str(path)) as container:
        frames = list(container.decode(video=0))
        codec = container.streams.video[0].codec_context.codec.canonical_name
    keys = [k for k, frame in enumerate(frames) if frame.key_frame]
    return Decoded(
        codec, np.array([frame.time for frame in frames]), [f.to_ndarray(format="rgb24") for f in frames], keys
    )


def test_variable_time_stamps_are_kept(video: Path, tmp_path: Path) -> None:
    seen: list[int] = []
    assert make_proxy(video, tmp_path / "proxy.mp4", max_height_px=HEIGHT_PX, progress=seen.append) == FRAMES
    proxy = decoded(tmp_path / "proxy.mp4")
    assert proxy.codec == "av1"
    np.testing.assert_allclose(proxy.time_s, frame_times_s(), atol=1e-4)
    assert seen == list(range(1, FRAMES + 1))


def test_every_picture_is_its_own(video: Path, tmp_path: Path) -> None:
    make_proxy(video, tmp_path / "proxy.mp4", max_height_px=HEIGHT_PX)
    proxy = decoded(tmp_path / "proxy.mp4")
    assert proxy.images[0].shape == (HEIGHT_PX, WIDTH_PX, 3)
    for image, centres in zip(proxy.images, positions_px(), strict=True):
        is_body = image[..., 0] > 150
        found = np.argwhere(is_body).mean(axis=0)[::-1]
        np.testing.assert_allclose(found, centres.mean(axis=0), atol=0.5)
    np.testing.assert_allclose(proxy.images[0][90, 40], BODY, atol=12)


def test_key_frames_are_close_enough_to_jump(video: Path, tmp_path: Path) -> None:
    make_proxy(video, tmp_path / "proxy.mp4", max_height_px=HEIGHT_PX)
    keys = decoded(tmp_path / "proxy.mp4").keys
    assert keys[0] == 0
    assert max(np.diff([*keys, FRAMES])) <= 32


def test_a_small_video_keeps_its_size_but_for_a_multiple_of_four_rows(tmp_path: Path) -> None:
    with VideoWriter(tmp_path / "odd.mkv", 101, 75, codec="ffv1") as writer:
        for k in range(3):
            writer.write(np.full((75, 101, 3), 40 * k, np.uint8))
    make_proxy(tmp_path / "odd.mkv", tmp_path / "proxy.mp4")
    assert decoded(tmp_path / "proxy.mp4").images[0].shape == (72, 96, 3)


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_a_turned_video_stands_upright(video: Path, tmp_path: Path, quarters: int) -> None:
    turned = tmp_path / "turned.mp4"
    turned.write_bytes(with_turn(video.read_bytes(), quarters))
    upright = np.rot90(decoded(video).images[0], -quarters)
    make_proxy(turned, tmp_path / "proxy.mp4", max_height_px=len(upright) // 2)
    image, small = decoded(tmp_path / "proxy.mp4").images[0], upright[::2, ::2]
    assert image.shape == small.shape
    assert np.mean(np.abs(image.astype(float) - small)) < 4


def with_turn(mp4: bytes, quarters: int) -> bytes:
    """The file, told to be shown turned clockwise by quarters of a circle (ISO 14496-12, 8.3.2: the track's matrix)."""
    cos, sin = round(np.cos(quarters * np.pi / 2)), round(np.sin(quarters * np.pi / 2))
    matrix = struct.pack(">9i", cos << 16, sin << 16, 0, -sin << 16, cos << 16, 0, 0, 0, 1 << 30)
    upright = struct.pack(">9i", 1 << 16, 0, 0, 0, 1 << 16, 0, 0, 0, 1 << 30)
    at = mp4.index(upright, mp4.index(b"tkhd"))
    return mp4[:at] + matrix + mp4[at + len(matrix) :]


def test_a_truncated_video_gives_what_can_be_read(tmp_path: Path) -> None:
    whole = write_video(tmp_path / "whole.mkv")
    cut = tmp_path / "cut.mkv"
    cut.write_bytes(whole.read_bytes()[: int(0.6 * whole.stat().st_size)])
    frames = make_proxy(cut, tmp_path / "proxy.mp4")
    assert 5 < frames < FRAMES
    np.testing.assert_allclose(decoded(tmp_path / "proxy.mp4").time_s, frame_times_s()[:frames], atol=1e-3)


def test_what_is_no_video_is_refused_and_nothing_is_left(tmp_path: Path) -> None:
    (tmp_path / "notes.mp4").write_text("not a video")
    for name, reason in (("notes.mp4", "cannot be read"), ("absent.mp4", "No such file")):
        with pytest.raises(InputError, match=reason):
            make_proxy(tmp_path / name, tmp_path / "proxy.mp4")
    assert [entry.name for entry in tmp_path.iterdir()] == ["notes.mp4"]


def test_an_interrupt_leaves_nothing_half_written(video: Path, tmp_path: Path) -> None:
    def interrupt(frames: int) -> None:
        if frames == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make_proxy(video, tmp_path / "proxy.mp4", progress=interrupt)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not hasattr(os, "sched_getscheduler"), reason="no such scheduler on this system")
def test_making_one_leaves_no_thread_before_all_else_on_the_machine(video: Path, tmp_path: Path) -> None:
    """SVT-AV1 takes real-time priority as root, and the process kept it: programs it started froze the machine."""
    make_proxy(video, tmp_path / "small.mp4")
    policies = {os.sched_getscheduler(int(task.name)) for task in Path("/proc/self/task").iterdir()}
    assert os.SCHED_FIFO not in policies
