"""A damaged file yields what is readable, under the right numbers, and says what is missing."""

import re
from collections.abc import Callable
from pathlib import Path

import av
import numpy as np
import pytest

from swimcal.errors import InputError
from tests.tracking.video.clips import GOP, Clip, number_in
from tracking.video import Video

LONG = {
    "mp4": Clip(".mp4", "libx264", frames=120, options=GOP, container={"movflags": "faststart"}),
    "mp4-fragments": Clip(".mp4", "libx264", frames=120, options=GOP, container={"movflags": "frag_keyframe"}),
    "mkv": Clip(".mkv", "libx264", frames=120, options=GOP),
    "ts": Clip(".ts", "libx264", frames=120, options=GOP),
    "avi": Clip(".avi", "mjpeg", frames=120, pixels="yuvj420p"),
}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    return {name: clip.write(tmp_path_factory.mktemp(name)) for name, clip in LONG.items()}


def cut(path: Path, share: float, folder: Path) -> Path:
    """The first part of a file."""
    data = path.read_bytes()
    short = folder / path.name
    short.write_bytes(data[: int(share * len(data))])
    return short


def spoil(path: Path, folder: Path, runs: int, seed: int, length: int = 24) -> Path:
    """A copy with runs of random bytes in its middle part."""
    data = bytearray(path.read_bytes())
    rng = np.random.default_rng(seed)
    for at in rng.integers(int(0.3 * len(data)), int(0.8 * len(data)), runs):
        data[at : at + length] = rng.bytes(length)
    spoilt = folder / path.name
    spoilt.write_bytes(data)
    return spoilt


def number_if_intact(luma: np.ndarray) -> int | None:
    """The number a picture carries; None if what it leans on was damaged."""
    try:
        return number_in(luma)
    except AssertionError:
        return None


@pytest.mark.parametrize("name", LONG)
@pytest.mark.parametrize("share", [0.55, 0.8])
@pytest.mark.parametrize("threads", [0, 1])
def test_a_file_cut_short_gives_its_frames_up_to_the_cut(
    name: str, share: float, threads: int, whole: dict[str, Path], tmp_path: Path
) -> None:
    with Video(cut(whole[name], share, tmp_path), threads=threads) as video:
        shown = [number_if_intact(frame.luma) for frame in video.frames()]
        assert len(shown) > share * 120 - 15
        assert shown[: len(shown) - 4] == list(range(len(shown) - 4))
        assert video.info.frames - len(shown) <= 4


def test_an_avi_whose_camera_left_frames_out_is_whole(tmp_path: Path) -> None:
    stamps_ms = [20 * k for k in range(40) if k not in (7, 8, 23)]
    path = Clip(".avi", "mjpeg", frames=len(stamps_ms), pixels="yuvj420p", stamps_ms=stamps_ms).write(tmp_path)
    with Video(path) as video:
        assert video.info.time_s == pytest.approx(np.array(stamps_ms) / 1000)
        assert video.damage is None


@pytest.mark.parametrize(("name", "expected"), [("mp4", "120"), ("mkv", r"about 1\d\d"), ("avi", "120")])
def test_a_file_cut_short_says_where_it_ends_and_what_was_expected(
    name: str, expected: str, whole: dict[str, Path], tmp_path: Path
) -> None:
    with Video(cut(whole[name], 0.6, tmp_path)) as video:
        assert re.search(rf"the file ends after \d\d of {expected} frames, at 2\.\d+ s", str(video.damage))
        assert str(video.damage).endswith(": copy it again from the card")
        assert video.damage == video.info.damage == video.info.caveats[0]


@pytest.mark.parametrize("name", ["mp4", "mkv", "ts", "avi"])
@pytest.mark.parametrize("seed", range(6))
def test_frames_after_spoilt_bytes_keep_their_numbers_and_times(
    name: str, seed: int, whole: dict[str, Path], tmp_path: Path
) -> None:
    with Video(spoil(whole[name], tmp_path, runs=2, seed=seed)) as video:
        frames = list(video.frames())
        assert len(frames) > 100
        trusted = [frame for frame in frames if not video.suspect[frame.number]]
        assert len(trusted) > 60
        right = [number_if_intact(frame.luma) == round(30 * frame.time_s) for frame in trusted]
        if name in ("mp4", "mkv"):
            assert all(right)
        assert np.mean(right) > 0.9  # a transport stream loses packets unnoticed, MJPEG fills in unnoticed
        assert frames[-1].time_s == pytest.approx(119 / 30, abs=1e-3)


@pytest.mark.parametrize("seed", range(6))
def test_spoilt_fragments_give_what_is_readable(seed: int, whole: dict[str, Path], tmp_path: Path) -> None:
    with Video(spoil(whole["mp4-fragments"], tmp_path, runs=2, seed=seed)) as video:
        times_s = [frame.time_s for frame in video.frames()]
        assert len(times_s) > 20
        assert np.all(np.diff(times_s) > 0)
        assert video.damage is not None


def test_frames_missing_from_a_steady_video_are_reported_and_those_of_a_variable_rate_are_not(tmp_path: Path) -> None:
    """As where part of a Matroska file is spoilt: nothing else tells that they were there."""
    missing = [*range(0, 660, 33), *range(759, 1419, 33)]  # three frames between
    with Video(Clip(".mkv", "libx264", stamps_ms=missing).write(tmp_path)) as video:
        assert video.info.caveats == ("time jumps by 0.132 s after frame 19",)
    variable = np.cumsum(np.random.default_rng(1).choice([16, 33, 100], 40)).tolist()
    with Video(Clip(".mkv", "libx264", stamps_ms=variable).write(tmp_path)) as video:
        assert video.info.caveats == ()


def test_lost_frames_are_named_with_their_time(whole: dict[str, Path], tmp_path: Path) -> None:
    data = bytearray(whole["avi"].read_bytes())
    with av.open(str(whole["avi"])) as container:
        at = [packet.pos for packet in container.demux(video=0) if packet.size]
    for number in (30, 31, 50):
        data[at[number] + 8 : at[number + 1] - 8] = bytes(at[number + 1] - at[number] - 16)
    path = tmp_path / "spoilt.avi"
    path.write_bytes(data)
    with Video(path) as video:
        assert video.damage is None  # nothing is decoded yet
        numbers = [frame.number for frame in video.frames()]
        assert numbers == sorted(set(range(120)) - {30, 31, 50})
        assert video.damage == "3 of 120 frames cannot be decoded: 30 to 31 (1.000 s), 50 (1.667 s)"
        assert list(np.flatnonzero(video.suspect)) == [30, 31, 50]
        with pytest.raises(InputError, match=r"frame 31: cannot be decoded; found damaged data at 1\.033 s"):
            video.frame(31)
        assert number_in(video.frame(32).luma) == 32


def test_an_mp4_without_its_index_says_what_to_do(clip: Callable[[str], Path], tmp_path: Path) -> None:
    short = cut(clip("h264-mp4"), 0.7, tmp_path)  # the index stands at the end
    with pytest.raises(InputError) as refused:
        Video(short)
    message = str(refused.value)
    assert message.startswith(f"{short}: the index of this MP4 or MOV file (its moov atom) is missing or damaged")
    assert re.search(r"found [0-9.]+ kB without a readable index", message)
    assert "put the card back into the camera" in message


@pytest.mark.parametrize("bytes_left", [200, 6000])
def test_an_avi_without_pictures_says_what_to_do(bytes_left: int, whole: dict[str, Path], tmp_path: Path) -> None:
    (tmp_path / "short.avi").write_bytes(whole["avi"].read_bytes()[:bytes_left])
    with pytest.raises(InputError, match="Copy it again from the camera's card"):
        Video(tmp_path / "short.avi")


def test_what_is_no_video_is_refused_by_name(tmp_path: Path) -> None:
    (tmp_path / "empty.mp4").touch()
    (tmp_path / "notes.mp4").write_text("no video, only words\n" * 50)
    (tmp_path / "folder.mp4").mkdir()
    expected = {
        "missing.mp4": "the file is not there",
        "empty.mp4": "empty file; found 0 bytes",
        "notes.mp4": "not a readable video; found 1.1 kB of something else",
        "folder.mp4": "not a file; found a folder",
    }
    for name, message in expected.items():
        with pytest.raises(InputError) as refused:
            Video(tmp_path / name)
        assert message in str(refused.value)
        assert "expected a video file (MP4, MOV, MKV, AVI, WebM, ...)" in str(refused.value)


def test_sound_alone_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "sound.m4a"
    with av.open(str(path), "w", format="mp4") as container:
        stream = container.add_stream("aac", rate=44100, layout="mono")
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 44100), np.float32), format="fltp", layout="mono")
        frame.sample_rate = 44100
        container.mux(stream.encode(frame))
        container.mux(stream.encode())
    with pytest.raises(InputError, match="no pictures in this file; found audio; expected a video stream"):
        Video(path)


def test_a_file_without_a_readable_frame_is_refused(clip: Callable[[str], Path], tmp_path: Path) -> None:
    source = clip("ffv1-mkv")
    data = bytearray(source.read_bytes())
    with av.open(str(source)) as container:
        for packet in container.demux(video=0):
            if packet.size:
                at = data.index(bytes(packet))
                data[at : at + packet.size] = bytes(packet.size)
    path = tmp_path / "zeros.mkv"
    path.write_bytes(data)
    with pytest.raises(InputError, match="no frame of this video can be decoded; found 40 packets of ffv1"):
        Video(path)
