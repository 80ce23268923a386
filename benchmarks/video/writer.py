"""Writer of videos, frame by frame, with time stamps of one's own and nothing half-written."""

from __future__ import annotations

import math
from contextlib import ExitStack
from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import Literal, Self, cast

import av
import numpy as np

from swimcal.results import writing_whole

Codec = Literal["h264", "hevc", "ffv1"]
_ENCODERS = {"h264": "libx264", "hevc": "libx265", "ffv1": "ffv1"}
_KEPT_AS = {"rgb24": "bgr0"}  # FFV1 keeps such pixels in this form.
_BT709 = 1  # FFmpeg's AVCOL_SPC_BT709
_LIMITED_RANGE = 1  # FFmpeg's AVCOL_RANGE_MPEG
_TICKS_HZ = 60_000  # The coarsest clock of a video has at least so many ticks a second.


class VideoWriter:
    """Writer of a video, as a context manager; the file appears under its name when the block ends well.

    H.264 and HEVC hold 4:2:0 colour (BT.709, limited range); FFV1 keeps every bit. In MP4 a
    time stamp is exact to 1/60000 s or better, in Matroska to 1 ms.

    Args:
        path: file to write; its suffix names the container, such as .mp4 (which also takes FFV1) or .mkv.
        width_px: width of every picture; even for H.264 and HEVC.
        height_px: height of every picture; even for H.264 and HEVC.
        fps: nominal frames a second, exact where a `Fraction` such as 60000/1001.
        codec: "h264", "hevc" or "ffv1".
        crf: quality of H.264 and HEVC, 0 (best) to 51; FFV1 takes none.
        preset: speed of H.264 and HEVC, as their encoders name it.

    Raises:
        swimcal.errors.ResultsNotWritable: the file cannot be written.
    """

    def __init__(
        self,
        path: Path,
        width_px: int,
        height_px: int,
        fps: float | Fraction = 60.0,
        codec: Codec = "h264",
        crf: float = 23,
        preset: str = "veryfast",
    ) -> None:
        self._path, self._codec, self._size = path, codec, (width_px, height_px)
        self._fps = Fraction(fps).limit_denominator(1001)
        self._options = {"level": "3"} if codec == "ffv1" else {"crf": str(crf), "preset": preset}
        if codec == "hevc":
            self._options["x265-params"] = "log-level=error"
        self._tick_s = 1 / Fraction(self._fps.numerator * math.ceil(_TICKS_HZ / self._fps.numerator))
        self._undo = ExitStack()
        self._stream: av.VideoStream | None = None  # opened by the first picture, which is gray or colour
        self._frames = 0

    def __enter__(self) -> Self:
        self._part = self._undo.enter_context(writing_whole(self._path))
        return self

    def write(self, image: np.ndarray, time_s: float | None = None) -> None:
        """Append a picture.

        Args:
            image: (h, w, 3) RGB, (h, w) gray or (3 h / 2, w) planes of yuv420p, uint8; all pictures of one kind.
            time_s: time at which it is shown, later than the picture before; default: its number over `fps`.
        """
        w, h = self._size
        pixels = {(h, w, 3): "rgb24", (h, w): "gray", (3 * h // 2, w): "yuv420p"}[image.shape]
        stream = self._stream or self._open(pixels)
        frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(image), format=pixels)
        if pixels != stream.pix_fmt:
            frame = frame.reformat(format=stream.pix_fmt, dst_colorspace="itu709")
        shown_s = self._frames / self._fps if time_s is None else Fraction(time_s)
        frame.pts, frame.time_base = round(shown_s / self._tick_s), self._tick_s
        self._container.mux(stream.encode(frame))
        self._frames += 1

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._undo:  # closes the container, then renames the file or, after an error, removes it
            if error is not None:
                raise error
            assert self._stream is not None, f"{self._path}: found no picture, expected at least one"
            self._container.mux(self._stream.encode(None))

    def _open(self, pixels: str) -> av.VideoStream:
        self._container = self._undo.enter_context(av.open(str(self._part), "w", options={"fflags": "+bitexact"}))
        added = self._container.add_stream(_ENCODERS[self._codec], rate=self._fps, options=self._options)
        stream = cast(av.VideoStream, added)
        stream.width, stream.height = self._size
        stream.pix_fmt = _KEPT_AS.get(pixels, pixels) if self._codec == "ffv1" else "yuv420p"
        stream.codec_context.time_base = self._tick_s
        stream.codec_context.thread_count = 0  # it chooses
        if stream.pix_fmt == "yuv420p":
            stream.codec_context.colorspace, stream.codec_context.color_range = _BT709, _LIMITED_RANGE
        self._stream = stream
        return stream
