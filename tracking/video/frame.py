"""One decoded picture: its brightness as the codec stored it, its colours only when asked for; in square pixels."""

import re
from dataclasses import dataclass, field
from functools import cached_property

import av
import cv2
import numpy as np

BRIGHTNESS_FIRST = re.compile(r"(yuvj?4\d\dp|nv\d\d|gray)")
"""Pixel formats whose first plane is 8-bit brightness, one byte a pixel."""
DEEP_BRIGHTNESS_FIRST = re.compile(r"(?:yuv4\d\dp|gray)(9|10|12|14|16)(le|be)")
"""Pixel formats whose first plane is brightness in the low bits of two bytes, lowest or highest byte first."""
GRAY_16 = ("gray16le", "gray16be")
"""Pixel formats in which scientific cameras store 10, 12 or 14 bits without saying so."""

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
    _square_px: tuple[int, int] | None = field(default=None, repr=False)  # stored width and height in square pixels
    _bits: int = field(default=16, repr=False)  # that are used of gray in 16

    @cached_property
    def luma(self) -> np.ndarray:
        """(h, w) uint8 brightness, upright, read-only; pixel frame as everywhere (x right, y down).

        A view of the decoder's own memory wherever the video stores 8-bit brightness: nothing is copied, rows are
        further apart than `w` bytes, and a rotated video gives a view with negative or swapped strides (use
        `np.ascontiguousarray` on the part of interest before handing it to OpenCV). Values are as stored: most
        cameras use 16 to 235. Deeper brightness keeps its upper 8 bits; RGB pictures are converted, and pixels that are
        not square stretched.
        """
        luma = np.rot90(self._square(brightness(self._picture, self._bits)), self._quarter_turns)
        luma.flags.writeable = False
        return luma

    def rgb(self) -> np.ndarray:
        """(h, w, 3) uint8 colours, upright, a copy; costs several times what decoding costs."""
        if self._picture.format.name in GRAY_16:
            return np.ascontiguousarray(np.repeat(self.luma[..., None], 3, axis=2))
        stored = self._square(self._picture.to_ndarray(format="rgb24"))
        return np.ascontiguousarray(np.rot90(stored, self._quarter_turns))

    def _square(self, stored: np.ndarray) -> np.ndarray:
        """The stored picture in square pixels: stretched across where they are wide, along where they are high."""
        return stored if self._square_px is None else cv2.resize(np.ascontiguousarray(stored), self._square_px)

    def yuv(self) -> np.ndarray:
        """(h, w, 3) uint8 brightness and the two differences of colour, upright, a copy; a gray video has none: 128.

        Colours stored for every second pixel are taken to lie in the middle of those that share them.
        """
        if self._picture.format.name in GRAY_16:
            return np.dstack([self.luma, *np.full((2, *self.luma.shape), 128, np.uint8)])
        if not HALF_COLOUR.match(self._picture.format.name):
            stored = np.moveaxis(self._picture.to_ndarray(format="yuv444p"), 0, 2)
        else:
            picture = self._picture.reformat(format="yuv420p")
            size = picture.width, picture.height
            planes = [_plane(picture, number, np.uint8) for number in range(3)]
            stored = np.dstack([planes[0], *(cv2.resize(np.ascontiguousarray(plane), size) for plane in planes[1:])])
        return np.ascontiguousarray(np.rot90(self._square(stored), self._quarter_turns))

    def scaled(self, width_px: int, height_px: int) -> av.VideoFrame:
        """The picture in another size, upright, in YUV 4:2:0 (BT.601, which players assume), to be encoded."""
        turned = self._quarter_turns % 2
        stored = (height_px, width_px) if turned else (width_px, height_px)
        picture = self._picture
        if picture.format.name in GRAY_16:
            picture = av.VideoFrame.from_ndarray(np.ascontiguousarray(brightness(picture, self._bits)), format="gray")
        small = picture.reformat(*stored, format="yuv420p", dst_colorspace="ITU601", interpolation="AREA")
        if self._quarter_turns:
            upright: np.ndarray = np.ascontiguousarray(np.rot90(small.to_ndarray(format="rgb24"), self._quarter_turns))
            small = av.VideoFrame.from_ndarray(upright, format="rgb24").reformat(format="yuv420p")
        return small


def bits_used(picture: av.VideoFrame) -> int:
    """Count the bits that a gray picture of 16 uses, as cameras have them: 8 to 16; 16 for all other formats."""
    if picture.format.name not in GRAY_16:
        return 16
    brightest = int(_first_plane(picture, _two_bytes(picture.format.name)).max())
    return next(bits for bits in (8, 10, 12, 14, 16) if brightest < 2**bits)


def brightness(picture: av.VideoFrame, bits: int = 16) -> np.ndarray:
    """(h, w) uint8 brightness of a picture as it is stored; gray in 16 bits uses so many of them."""
    name = picture.format.name
    if BRIGHTNESS_FIRST.fullmatch(name):
        return _first_plane(picture, np.uint8)
    if deep := DEEP_BRIGHTNESS_FIRST.fullmatch(name):
        used = min(int(deep[1]), bits) if name in GRAY_16 else int(deep[1])
        return _upper_bits(_first_plane(picture, _two_bytes(name)), used - 8)
    if name in ("p010le", "p012le", "p016le"):  # brightness in the high bits
        return _upper_bits(_first_plane(picture, np.dtype("<u2")), 8)
    return _first_plane(picture.reformat(format="gray"), np.uint8)


def _two_bytes(name: str) -> np.dtype:
    return np.dtype(">u2" if name.endswith("be") else "<u2")


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
    """(h, w) uint8 of the values without their lowest bits; what is beyond 8 bits then is as bright as can be."""
    if shift < 8:
        return np.minimum(np.right_shift(deep, shift), 255).astype(np.uint8)
    return np.right_shift(deep, shift, out=np.empty(deep.shape, np.uint8), casting="unsafe")
