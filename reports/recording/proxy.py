"""The small copy of a video for the viewer: same frames, same time stamps, fewer pixels."""

import os
from collections.abc import Callable
from contextlib import suppress
from fractions import Fraction
from pathlib import Path
from typing import cast

import av

from session.results import writing_whole
from tracking.video import Video

CODEC = "libsvtav1"
# Preset 9 kept moving markers within 0.15 px of their place, 10 within 0.7; no filter that mixes pictures.
OPTIONS = {"preset": "9", "crf": "30", "svtav1-params": "enable-tf=0"}
GROUP = 30  # frames from one key frame to the next: few, so that the viewer can jump
# The height is a multiple of this: the viewer (Rerun 0.41) shifts the colours of a picture of another height.
STEP_PX = 4
TICKS = 90_000  # ticks of the time stamps in a second

Progress = Callable[[int], None]


def make_proxy(video: Path, out: Path, max_height_px: int = 720, progress: Progress | None = None) -> int:
    """Make a small AV1 copy of a video in MP4, upright, for `RecordedTrial.video_proxy`.

    AV1, because the Rerun viewer decodes it by itself in its window and in the browser; for H.264 its window needs an
    FFmpeg of the user's. Time stamps are those of the video, variable ones too, counted from the first frame. Of a
    damaged file the frames that can be read are kept.

    Args:
        video: a file that `tracking.video.Video` reads.
        out: the copy, ending in ``.mp4``; written whole or not at all.
        max_height_px: largest height of the copy. A smaller video keeps its size, made a multiple of 4 high and even
            wide.
        progress: called after each frame with the number of frames done.

    Returns:
        The number of frames.

    Raises:
        InputError: the video cannot be read.
        ResultsNotWritable: the copy cannot be written.
    """
    os.environ.setdefault("SVT_LOG", "1")  # errors alone: the encoder's messages go past Python to the terminal
    done = 0
    with Video(video) as source, writing_whole(out) as part, av.open(str(part), "w") as sink:
        info = source.info
        height_px = max(min(info.height_px, max_height_px) // STEP_PX, 1) * STEP_PX
        width_px = max(round(info.width_px * height_px / info.height_px / 2) * 2, 2)
        rate = Fraction(info.fps).limit_denominator(1001) if info.frames > 1 else 60
        encoder = cast(av.VideoStream, sink.add_stream(CODEC, rate=rate, options=OPTIONS))
        encoder.width, encoder.height, encoder.pix_fmt = width_px, height_px, "yuv420p"
        encoder.codec_context.time_base = Fraction(1, TICKS)
        encoder.codec_context.gop_size = GROUP
        for done, frame in enumerate(source.frames(), 1):
            small = frame.scaled(width_px, height_px)
            small.pts, small.time_base, small.pict_type = round(frame.time_s * TICKS), Fraction(1, TICKS), 0
            sink.mux(encoder.encode(small))
            if done == 1:
                _yield_the_machine()
            if progress:
                progress(done)
        sink.mux(encoder.encode(None))
    return done


def _yield_the_machine() -> None:
    """Give back the real-time priority that SVT-AV1 takes where it may (as root): it froze everything else."""
    tasks = Path("/proc/self/task")
    for task in tasks.iterdir() if tasks.exists() else ():
        with suppress(OSError):  # a thread that has ended
            if os.sched_getscheduler(int(task.name)) == os.SCHED_FIFO:
                os.sched_setscheduler(int(task.name), os.SCHED_OTHER, os.sched_param(0))
