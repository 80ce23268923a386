"""One decoded picture: its brightness as the codec stored it, its colours only when asked for."""

import re
from dataclasses import dataclass, field
from functools import cached_property

import av
import cv2
import numpy as np

BRIGHTNESS_FIRST = re.compile(r"(yuvj?4\d\dp|nv\d\d|gray)")
"""Pixel formats whose first plane is 8-bit brightness, one byte a pixel."""
DEEP_BRIGHTNESS_FIRST = re.compile(r"(?:yuv4\d\dp|gray)(9|10|12|14|16)le")
"""Pixel formats whose first plane is brightness in the low bits of two bytes, lowest byte first."""

HALF_COLOUR = re.compile(r"yuvj?42\dp|nv\d\d|p01[026]")
"""Pixel formats that store colours for every second pixel."""


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

    def yuv(self) -> np.ndarray:
        """(h, w, 3) uint8 brightness and the two differences of colour, upright, a copy; a gray video has none: 128.

        Colours stored for every second pixel are taken to lie in the middle of those that share them.
        """
        if not HALF_COLOUR.match(self._picture.format.name):
            stored = np.moveaxis(self._picture.to_ndarray(format="yuv444p"), 0, 2)
        else:
            picture = self._picture.reformat(format="yuv420p")
            size = picture.width, picture.height
            planes = [_plane(picture, number, np.uint8) for number in range(3)]
            stored = np.dstack([planes[0], *(cv2.resize(np.ascontiguousarray(plane), size) for plane in planes[1:])])
        return np.ascontiguousarray(np.rot90(stored, self._quarter_turns))

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
    return _plane(picture, 0, dtype)


def _plane(picture: av.VideoFrame, number: int, dtype: np.typing.DTypeLike) -> np.ndarray:
    """(h, w) view of a plane without the padding of its rows."""
    plane = picture.planes[number]
    pixel = np.dtype(dtype)
    shape, row = (plane.height, plane.width), abs(plane.line_size)
    rows: np.ndarray = np.ndarray(shape, pixel, buffer=memoryview(plane), strides=(row, pixel.itemsize))
    return rows if plane.line_size > 0 else rows[::-1]


def _upper_bits(deep: np.ndarray, shift: int) -> np.ndarray:
    return np.right_shift(deep, shift, out=np.empty(deep.shape, np.uint8), casting="unsafe")
