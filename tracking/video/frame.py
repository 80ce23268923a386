"""One decoded picture: its brightness as the codec stored it, its colours only when asked for."""

import re
from dataclasses import dataclass, field
from functools import cached_property

import av
import numpy as np

BRIGHTNESS_FIRST = re.compile(r"(yuvj?4\d\dp|nv\d\d|gray)")
"""Pixel formats whose first plane is 8-bit brightness, one byte a pixel."""
DEEP_BRIGHTNESS_FIRST = re.compile(r"(?:yuv4\d\dp|gray)(9|10|12|14|16)le")
"""Pixel formats whose first plane is brightness in the low bits of two bytes, lowest byte first."""


@dataclass(frozen=True, eq=False)
class Frame:
    """A frame of a video.

    It stays readable for as long as it is held, and holds one of the decoder's pictures: let go of what is done with.

    Attributes:
        number: its place in order of presentation, from 0.
        time_s: its time from the first frame, from the file's time stamps.
    """

    number: int
    time_s: float
    _picture: av.VideoFrame = field(repr=False)
    _quarter_turns: int = field(default=0, repr=False)

    @cached_property
    def luma(self) -> np.ndarray:
        """(h, w) uint8 brightness, upright, read-only; pixel frame as everywhere (x right, y down).

        A view of the decoder's own memory wherever the video stores 8-bit brightness: nothing is copied, rows are
        further apart than `w` bytes, and a rotated video gives a view with negative or swapped strides (use
        `np.ascontiguousarray` on the part of interest before handing it to OpenCV). Values are as stored: most
        cameras use 16 to 235. Deeper brightness keeps its upper 8 bits; RGB pictures are converted.
        """
        luma = np.rot90(_brightness(self._picture), self._quarter_turns)
        luma.flags.writeable = False
        return luma

    def rgb(self) -> np.ndarray:
        """(h, w, 3) uint8 colours, upright, a copy; costs several times what decoding costs."""
        return np.ascontiguousarray(np.rot90(self._picture.to_ndarray(format="rgb24"), self._quarter_turns))

    def scaled(self, width_px: int, height_px: int) -> av.VideoFrame:
        """The picture in another size, upright, in YUV 4:2:0 (BT.601, which players assume), to be encoded."""
        turned = self._quarter_turns % 2
        stored = (height_px, width_px) if turned else (width_px, height_px)
        small = self._picture.reformat(*stored, format="yuv420p", dst_colorspace="ITU601", interpolation="AREA")
        if self._quarter_turns:
            upright: np.ndarray = np.ascontiguousarray(np.rot90(small.to_ndarray(format="rgb24"), self._quarter_turns))
            small = av.VideoFrame.from_ndarray(upright, format="rgb24").reformat(format="yuv420p")
        return small


def _brightness(picture: av.VideoFrame) -> np.ndarray:
    """(h, w) uint8 brightness of a picture as it is stored."""
    name = picture.format.name
    if BRIGHTNESS_FIRST.fullmatch(name):
        return _first_plane(picture, np.uint8)
    if deep := DEEP_BRIGHTNESS_FIRST.fullmatch(name):
        return _upper_bits(_first_plane(picture, np.dtype("<u2")), int(deep[1]) - 8)
    if name in ("p010le", "p012le", "p016le"):  # brightness in the high bits
        return _upper_bits(_first_plane(picture, np.dtype("<u2")), 8)
    return _first_plane(picture.reformat(format="gray"), np.uint8)


def _first_plane(picture: av.VideoFrame, dtype: np.typing.DTypeLike) -> np.ndarray:
    """(h, w) view of the first plane without the padding of its rows."""
    plane = picture.planes[0]
    pixel = np.dtype(dtype)
    shape, row = (picture.height, picture.width), abs(plane.line_size)
    rows: np.ndarray = np.ndarray(shape, pixel, buffer=memoryview(plane), strides=(row, pixel.itemsize))
    return rows if plane.line_size > 0 else rows[::-1]


def _upper_bits(deep: np.ndarray, shift: int) -> np.ndarray:
    return np.right_shift(deep, shift, out=np.empty(deep.shape, np.uint8), casting="unsafe")
