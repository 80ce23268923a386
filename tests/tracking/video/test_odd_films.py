"""Films without a clock, with pixels that are not square, in depths that the format does not tell, from odd paths."""

from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

from tests.tracking.video.clips import HEIGHT, WIDTH, Clip, number_in
from tracking.decoding import TimeSource, is_without_times
from tracking.harmed_frames import Repeats, unmoved_frames
from tracking.video import Video, backward


@pytest.mark.parametrize(("suffix", "codec", "form"), [(".h264", "libx264", "h264"), (".mjpeg", "mjpeg", "mjpeg")])
def test_a_raw_film_has_no_clock_but_the_one_it_is_given(tmp_path: Path, suffix: str, codec: str, form: str) -> None:
    pixels = "yuvj420p" if codec == "mjpeg" else "yuv420p"
    path = Clip(suffix, codec, frames=12, pixels=pixels, format=form).write(tmp_path)
    assert is_without_times(path)
    with Video(path, fps=120) as video:
        assert (video.info.has_clock, video.info.time_source) == (False, TimeSource.FRAME_RATE)
        assert video.info.fps == pytest.approx(120)


def test_a_rate_that_is_given_does_not_change_the_times_of_a_film_that_has_them(tmp_path: Path) -> None:
    path = Clip(".mp4", "libx264", frames=12).write(tmp_path)
    with Video(path, fps=120) as video:
        assert video.info.has_clock
        assert video.info.fps == pytest.approx(30)


@pytest.mark.parametrize("folder", ["2026-05-12T12:30", "tänk ß"])
def test_a_colon_or_an_umlaut_in_a_path_is_no_protocol(
    tmp_path: Path, folder: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path(folder).mkdir()
    path = Clip(".mkv", "ffv1", frames=3, pixels="gray").write(tmp_path).rename(tmp_path / folder / "clip.mkv")
    path = path.relative_to(tmp_path)
    with Video(path) as video:
        assert number_in(video.frame(2).luma) == 2


@pytest.mark.parametrize(("aspect", "size"), [((4, 3), (213, HEIGHT)), ((1, 2), (WIDTH, 2 * HEIGHT))])
def test_pixels_are_made_square(tmp_path: Path, aspect: tuple[int, int], size: tuple[int, int]) -> None:
    path = tmp_path / "wide.mp4"
    with av.open(str(path), "w") as out:
        stream = out.add_stream("libx264", rate=30)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        stream.codec_context.sample_aspect_ratio = Fraction(*aspect)
        frame = av.VideoFrame.from_ndarray(np.full((HEIGHT, WIDTH, 3), 90, np.uint8), format="rgb24")
        out.mux([*stream.encode(frame), *stream.encode()])
    with Video(path) as video:
        frame = video.frame(0)
        assert (video.info.width_px, video.info.height_px) == size
        assert frame.luma.shape == size[::-1]
        assert frame.rgb().shape == (*size[::-1], 3)


@pytest.mark.parametrize("bits", [10, 12, 16])
def test_gray_in_sixteen_bits_is_as_bright_as_the_bits_that_are_used(tmp_path: Path, bits: int) -> None:
    path = tmp_path / "deep.mkv"
    with av.open(str(path), "w") as out:
        stream = out.add_stream("ffv1", rate=30)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "gray16le"
        for k in range(6):  # it gets bright late
            picture = np.full((48, 64), (2**bits - 1) * (0.05 if k < 4 else 1.0), np.uint16)
            out.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="gray16le")))
        out.mux(stream.encode())
    with Video(path) as video:
        dark, bright = video.frame(0), video.frame(5)
        assert bright.luma.min() == 255
        assert dark.luma.max() == pytest.approx(0.05 * 255, abs=1)
        assert bright.rgb().min() == 255


def test_frames_come_backward_as_they_come_forward(tmp_path: Path) -> None:
    path = Clip(".mp4", "libx264", options={"g": "8", "bf": "2"}).write(tmp_path)
    with Video(path) as video:
        found = [number_in(frame.luma) for frame in backward(video, 30)]
    assert found == list(range(29, -1, -1))


def moving(number: int) -> np.ndarray:
    """(h, w) a disc on its way."""
    y, x = np.mgrid[:120, :200]
    return np.where((x - 30 - 3 * number) ** 2 + (y - 60) ** 2 < 64, 220, 40).astype(np.uint8)


@pytest.mark.parametrize(
    ("shown", "repeats"),
    [
        (lambda k: k, []),
        (lambda k: k // 2, [*range(1, 39, 2)]),
        (lambda k: k - k // 6, [*range(6, 39, 6)]),
        (lambda k: min(k, 15), []),  # it comes to rest
        (lambda k: max(k - 15, 0), [*range(1, 1)]),  # it starts late
    ],
)
def test_pictures_that_repeat_are_told_from_a_robot_at_rest(shown, repeats) -> None:
    found = Repeats()
    for k in range(40):
        found.repeats(k, moving(shown(k)), np.array([[30.0 + 3 * shown(k), 60.0]]))
    assert found.frames == repeats
    assert found.are_many(40) == bool(repeats)


@pytest.mark.parametrize("place", [(-20.0, 60.0), (5000.0, 60.0), (np.nan, np.nan)])
def test_while_the_robot_is_out_of_the_picture_no_frame_repeats(place: tuple[float, float]) -> None:
    found = Repeats()
    for k in range(60):
        here = (30.0 + 3 * k, 60.0) if k < 30 else place
        assert not found.repeats(k, moving(min(k, 30)), np.array([here]))


@pytest.mark.parametrize("every", [2, 6])
def test_repeats_that_the_pictures_hide_show_in_the_markers(every: int) -> None:
    shown = np.array([k - (k % every == every - 1) for k in range(72)])
    rng = np.random.default_rng(every)
    sway = 40 * np.sin(0.13 * shown[:, None] - 0.5 * np.arange(4))
    position = np.stack([np.broadcast_to(50.0 * np.arange(4), sway.shape), sway], axis=2) + rng.normal(
        0, 0.1, (72, 4, 2)
    )
    repeats = np.flatnonzero(np.diff(shown, prepend=-1) == 0)
    hidden = rng.choice(repeats, 3, replace=False)
    assert unmoved_frames(position, sorted({*repeats} - {*hidden})) == sorted(hidden)


def test_a_tail_that_turns_back_does_not_repeat_a_frame() -> None:
    """Its tip moves by 20 px a frame in between, by 2 px where it turns, and the head by 1.5 px throughout."""
    time = np.arange(60)
    tip = 30 * np.sin(2 * np.pi * time / 9)
    position = np.stack([np.column_stack([1.5 * time, 0.0 * time]), np.column_stack([1.5 * time + 90, tip])], axis=1)
    assert unmoved_frames(np.repeat(position, 2, axis=0), list(range(1, 120, 2))) == []
