"""A small copy of a video, for the viewer: same frames, same time stamps, fewer pixels."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from fractions import Fraction
from pathlib import Path
from typing import cast

import av
import av.filter

from session import Fault, InputError, writing_whole

CODEC = "libsvtav1"
# Preset 9 kept moving markers within 0.15 px of their place, 10 within 0.7; no filter that mixes pictures.
OPTIONS = {"preset": "9", "crf": "30", "svtav1-params": "enable-tf=0"}
GROUP = 30  # frames from one key frame to the next: short, so that the viewer can jump
STEP_PX = 4  # of the height: the viewer (Rerun 0.41) shifts the colours of a picture of another height by some rows
TURNS = {90: ["cclock"], 180: ["clock", "clock"], 270: ["clock"]}  # counterclockwise, degrees

Progress = Callable[[int], None]


def make_proxy(video: Path, out: Path, max_height_px: int = 720, progress: Progress | None = None) -> int:
    """Makes a small AV1 copy of a video in MP4, upright, for `RecordedTrial.video_proxy`.

    AV1, because the Rerun viewer decodes it by itself in its window and in the browser; for H.264 its window asks
    for an FFmpeg of the user's. Time stamps are those of the video, variable ones too, counted from the first frame.
    Of a damaged file the frames that can be read are kept.

    Args:
        video: of any container and codec that PyAV reads.
        out: the copy, ending in ``.mp4``; written whole or not at all.
        max_height_px: of the copy. A smaller video keeps its size, made a multiple of 4 high and even wide.
        progress: called after each frame with the number of frames done.

    Returns:
        The number of frames.

    Raises:
        InputError: the video cannot be read, or has no frame that can.
        ResultsNotWritable: the copy cannot be written.
    """
    done = 0
    with writing_whole(out) as part, _quiet(), _opened(video) as source, av.open(str(part), "w") as sink:
        encoder = sink.add_stream(CODEC, rate=source.streams.video[0].average_rate or Fraction(60), options=OPTIONS)
        encoder = cast(av.VideoStream, encoder)
        for done, frame in enumerate(_small_frames(source, max_height_px), 1):
            if done == 1:
                _set_up(encoder, frame)
            sink.mux(encoder.encode(frame))
            if done == 1:
                _yield_the_machine()
            if progress:
                progress(done)
        if not done:
            raise _unreadable(video, "no frame that can be decoded")
        sink.mux(encoder.encode(None))
    return done


def _set_up(encoder: av.VideoStream, frame: av.VideoFrame) -> None:
    encoder.width, encoder.height, encoder.pix_fmt = frame.width, frame.height, "yuv420p"
    encoder.codec_context.time_base = cast(Fraction, frame.time_base)
    encoder.codec_context.gop_size = GROUP


def _small_frames(source: av.container.InputContainer, max_height_px: int) -> Iterator[av.VideoFrame]:
    """Upright, small frames with strictly increasing time stamps from 0."""
    graph, first, last = None, 0, -1
    for frame in _decoded(source):
        if frame.pts is None or (graph is not None and frame.pts - first <= last):
            continue
        if graph is None:
            graph, first = _graph(source.streams.video[0], frame, max_height_px), frame.pts
        last = frame.pts - first
        graph.push(frame)
        small = cast(av.VideoFrame, graph.pull())
        small.pts, small.time_base, small.pict_type = last, frame.time_base, 0
        yield small


def _decoded(source: av.container.InputContainer) -> Iterator[av.VideoFrame]:
    """The frames that can be decoded, up to where the file can be read."""
    stream = source.streams.video[0]
    stream.thread_type = "AUTO"
    packets = source.demux(stream)
    while True:
        try:
            packet = next(packets, None)
        except av.error.FFmpegError:
            return
        if packet is None:
            return
        try:
            yield from packet.decode()
        except av.error.InvalidDataError:
            continue


def _graph(stream: av.VideoStream, frame: av.VideoFrame, max_height_px: int) -> av.filter.Graph:
    """A filter that turns a frame upright and makes it small."""
    turns = TURNS.get(frame.rotation % 360, [])
    width, height = (frame.height, frame.width) if len(turns) == 1 else (frame.width, frame.height)
    small = max(min(height, max_height_px) // STEP_PX, 1) * STEP_PX
    size = f"{max(round(width * small / height / 2) * 2, 2)}:{small}"
    graph = av.filter.Graph()
    nodes = [graph.add_buffer(template=stream), *(graph.add("transpose", turn) for turn in turns)]
    nodes += [graph.add("scale", f"{size}:flags=area"), graph.add("format", "yuv420p"), graph.add("buffersink")]
    graph.link_nodes(*nodes).configure()
    return graph


@contextmanager
def _opened(video: Path) -> Iterator[av.container.InputContainer]:
    try:
        source = av.open(str(video))
    except (OSError, av.error.FFmpegError) as error:
        raise _unreadable(video, str(error)) from error
    with source:
        if not source.streams.video:
            raise _unreadable(video, "no video stream")
        yield source


def _yield_the_machine() -> None:
    """Gives back the real-time priority that SVT-AV1 takes where it may (as root): it froze all else on the machine."""
    tasks = Path("/proc/self/task")
    for task in tasks.iterdir() if tasks.exists() else ():
        with suppress(OSError):  # a thread that has ended
            if os.sched_getscheduler(int(task.name)) == os.SCHED_FIFO:
                os.sched_setscheduler(int(task.name), os.SCHED_OTHER, os.sched_param(0))


@contextmanager
def _quiet() -> Iterator[None]:
    """Keeps the encoder's chatter, which goes past Python to the terminal, to errors."""
    name, before = "SVT_LOG", os.environ.get("SVT_LOG")
    os.environ[name] = before or "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[name]


def _unreadable(video: Path, found: str) -> InputError:
    expected = "a video that FFmpeg reads"
    return InputError(
        [Fault(str(video), "", "cannot be read", found, expected, (), "Check that it plays in a player.")]
    )
