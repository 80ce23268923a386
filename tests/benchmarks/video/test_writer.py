from pathlib import Path

import av
import numpy as np
import pytest

from benchmarks.video.writer import Codec, VideoWriter

SIZE = (48, 64)


def picture(seed: int, *, gray: bool = False) -> np.ndarray:
    """A smooth random picture."""
    coarse = np.random.default_rng(seed).integers(0, 255, (6, 8) if gray else (6, 8, 3), dtype=np.uint8)
    return coarse.repeat(8, axis=0).repeat(8, axis=1)


def decoded(path: Path, pixels: str = "rgb24") -> tuple[np.ndarray, np.ndarray]:
    """Times and pictures of a video."""
    with av.open(str(path)) as container:
        frames = list(container.decode(video=0))
    return np.array([frame.time for frame in frames]), np.array([frame.to_ndarray(format=pixels) for frame in frames])


@pytest.mark.parametrize("gray", [True, False])
def test_ffv1_keeps_every_bit(gray: bool, tmp_path: Path) -> None:
    pictures = np.random.default_rng(0).integers(0, 255, (3, *SIZE, *([] if gray else [3])), dtype=np.uint8)
    with VideoWriter(tmp_path / "a.mp4", 64, 48, codec="ffv1") as writer:
        for image in pictures:
            writer.write(image)

    time_s, found = decoded(tmp_path / "a.mp4", "gray" if gray else "rgb24")
    np.testing.assert_array_equal(found, pictures)
    np.testing.assert_allclose(time_s, np.arange(3) / 60, atol=1e-6)


@pytest.mark.parametrize("codec", ["h264", "hevc"])
@pytest.mark.parametrize("gray", [True, False])
def test_lossy_codecs_keep_the_picture_and_its_colours(codec: Codec, gray: bool, tmp_path: Path) -> None:
    with VideoWriter(tmp_path / "a.mp4", 64, 48, codec=codec, crf=5) as writer:
        for seed in range(4):
            writer.write(picture(seed, gray=gray))

    _, found = decoded(tmp_path / "a.mp4", "gray" if gray else "rgb24")
    error = found.astype(float) - [picture(seed, gray=gray) for seed in range(4)]
    middle = error.reshape(4, 6, 8, 8, 8, -1)[:, :, 3:5, :, 3:5]  # fields of 8 x 8: chroma is blurred at their edges
    assert np.sqrt(np.mean(middle**2)) < 4


@pytest.mark.parametrize("codec", ["h264", "hevc", "ffv1"])
def test_a_variable_rate_is_kept_to_a_sixtieth_of_a_millisecond(codec: Codec, tmp_path: Path) -> None:
    asked_s = np.cumsum([0.0, 1 / 60, 1 / 30, 0.0123, 0.5])
    with VideoWriter(tmp_path / "a.mp4", 64, 48, codec=codec) as writer:
        for number, time_s in enumerate(asked_s):
            writer.write(picture(number), time_s)

    np.testing.assert_allclose(decoded(tmp_path / "a.mp4")[0], asked_s, atol=0.6 / 60_000)
