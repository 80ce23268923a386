"""What a frame shows: upright, in full, without copies where none are needed."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.tracking.video.clips import Clip, number_in, picture
from tracking.video import Video


def lossless(suffix: str = ".mkv", pixels: str = "gray", **other: object) -> Clip:
    return Clip(suffix, "ffv1", frames=3, pixels=pixels, **other)  # type: ignore[arg-type]


def test_luma_is_a_view_that_cannot_be_written_to(clip: Callable[[str], Path]) -> None:
    with Video(clip("h264-mp4")) as video:
        frame = video.frame(4)
        assert frame.luma.base is not None
        assert frame.luma.strides[0] > frame.luma.shape[1]  # the decoder's own rows, with their padding
        assert frame.luma is frame.luma
        with pytest.raises(ValueError, match="read-only"):
            frame.luma[0, 0] = 0


@pytest.mark.parametrize("size", [(155, 91), (97, 65), (33, 33)])
def test_odd_sizes_keep_their_last_row_and_column(size: tuple[int, int], tmp_path: Path) -> None:
    with Video(lossless(pixels="yuv420p", size=size).write(tmp_path)) as video:
        assert (video.info.width_px, video.info.height_px) == size
        luma = video.frame(1).luma.astype(float)
        assert luma.shape == size[::-1]
        full_range = (luma - 16) * 255 / 219
        np.testing.assert_allclose(full_range, picture(1, *size), atol=1.2)


@pytest.mark.parametrize(("codec", "suffix"), [("libx265", ".mp4"), ("ffv1", ".mkv")])
def test_ten_bits_keep_the_upper_eight(codec: str, suffix: str, tmp_path: Path) -> None:
    quiet = {"x265-params": "log-level=none"} if codec == "libx265" else {}
    with Video(Clip(suffix, codec, pixels="yuv420p10le", options=quiet).write(tmp_path)) as video:
        assert video.frame(0).luma.dtype == np.uint8
        assert [number_in(frame.luma) for frame in video.frames()] == list(range(40))
        full_range = (video.frame(3).luma.astype(float) - 16) * 255 / 219
        assert abs(np.mean(full_range - picture(3))) < 1


@pytest.mark.parametrize("pixels", ["gray", "gray10le", "gray16le", "yuv444p", "yuv422p10le", "yuv420p12le", "bgr0"])
def test_every_layout_gives_the_same_brightness(pixels: str, tmp_path: Path) -> None:
    with Video(lossless(pixels=pixels).write(tmp_path)) as video:
        luma = video.frame(2).luma.astype(float)
    full_range = (luma - 16) * 255 / 219 if pixels.startswith("yuv") else luma
    np.testing.assert_allclose(full_range, picture(2), atol=2)


@pytest.mark.parametrize("turned_deg", [0, 90, 180, 270])
def test_a_turned_camera_gives_upright_pictures(turned_deg: int, tmp_path: Path) -> None:
    with Video(Clip(".mp4", "libx264", frames=5, turned_deg=turned_deg).write(tmp_path)) as video:
        assert (video.info.width_px, video.info.height_px) == (160, 96)
        assert video.info.rotation_deg == turned_deg
        assert [number_in(frame.luma) for frame in video.frames()] == list(range(5))
        assert number_in(video.frame(3).rgb()[..., 1]) == 3
        assert number_in(video.frame(3).scaled(160, 96).to_ndarray()[:96]) == 3
