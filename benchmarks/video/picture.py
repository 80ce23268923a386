"""Picture in the pixels of a video, 4:2:0, and how to paint shapes into it exactly."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from scipy.special import erf

# ITU-R BT.709, limited range: luma weights of red, green, blue.
# Weights of red, green and blue in the luma (BT.709).
_KR = 0.2126
_KG = 0.7152
_KB = 0.0722
_MARGIN_PX = 3.0


class Colour(NamedTuple):
    """A colour as a video holds it: luma 16 to 235, colour differences about 128."""

    luma: float
    blue: float
    red: float


def colour_of(red: float, green: float, blue: float) -> Colour:
    """Return a colour from red, green and blue of 0 to 255 (BT.709, limited range)."""
    bright = _KR * red + _KG * green + _KB * blue
    return Colour(
        16 + bright * 219 / 255,
        128 + (blue - bright) / (2 * (1 - _KB)) * 224 / 255,
        128 + (red - bright) / (2 * (1 - _KR)) * 224 / 255,
    )


class Region(NamedTuple):
    """Pixels left <= x < right, top <= y < bottom, with even corners."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def empty(self) -> bool:
        """Whether no pixel is in it."""
        return self.left >= self.right or self.top >= self.bottom

    def grid(self) -> tuple[np.ndarray, np.ndarray]:
        """Return (1, w) x and (h, 1) y of the pixels' centres."""
        x = np.arange(self.left, self.right, dtype=np.float32)
        return x[None], np.arange(self.top, self.bottom, dtype=np.float32)[:, None]


class Picture:
    """A picture: luma for each pixel, colour for each 2 x 2 of them.

    Args:
        width_px: width, a multiple of 2.
        height_px: height, a multiple of 4.

    Attributes:
        data: (3 h / 2, w) uint8, the planes after one another as FFmpeg's yuv420p has them.
        luma: (h, w) view of its luma.
        blue: (h / 2, w / 2) view of its blue difference.
        red: (h / 2, w / 2) view of its red difference.
    """

    def __init__(self, width_px: int, height_px: int) -> None:
        self.width_px, self.height_px = width_px, height_px
        self.data = np.empty((3 * height_px // 2, width_px), np.uint8)
        half = (height_px // 2, width_px // 2)
        self.luma = self.data[:height_px]
        self.blue = self.data[height_px : height_px * 5 // 4].reshape(half)
        self.red = self.data[height_px * 5 // 4 :].reshape(half)

    def region(self, low: np.ndarray, high: np.ndarray) -> Region:
        """Return the part of the picture around a box from corner (x, y) `low` to `high`, px."""
        left, top = (max(0, int(c - _MARGIN_PX) // 2 * 2) for c in low)
        right = min(self.width_px, int(high[0] + _MARGIN_PX + 2) // 2 * 2)
        return Region(left, top, right, min(self.height_px, int(high[1] + _MARGIN_PX + 2) // 2 * 2))

    def blend(self, region: Region, cover: np.ndarray, colour: Colour) -> None:
        """Paint a colour over a region.

        Args:
            region: region to paint.
            cover: (h, w) float32 cover of the region, 0 (leaves the picture) to 1 (hides it).
            colour: colour to paint.
        """
        left, top, right, bottom = region
        _mix(self.luma[top:bottom, left:right], cover, colour.luma)
        coarse = cover.reshape(cover.shape[0] // 2, 2, cover.shape[1] // 2, 2).mean(axis=(1, 3))
        half = (slice(top // 2, bottom // 2), slice(left // 2, right // 2))
        _mix(self.blue[half], coarse, colour.blue)
        _mix(self.red[half], coarse, colour.red)

    def paint_polygons(self, polygons: np.ndarray, colour: Colour, opacity: float = 1.0) -> None:
        """Paint the mean of convex polygons, which are one shape at several moments of an exposure.

        Args:
            polygons: (s, k, 2) corners, px.
            colour: colour to paint.
            opacity: share that is hidden of what was there, 0 to 1.
        """
        region = self.region(polygons.min(axis=(0, 1)), polygons.max(axis=(0, 1)))
        if region.empty:
            return
        total = np.zeros((region.bottom - region.top, region.right - region.left), np.float32)
        for polygon in polygons:
            hull = cv2.convexHull((polygon - region[:2]).astype(np.float32))
            mask = np.zeros(total.shape, np.uint8)
            cv2.fillConvexPoly(mask, np.round(hull * 16).astype(np.int32), 255, cv2.LINE_AA, 4)
            total += mask
        self.blend(region, total * (opacity / 255 / len(polygons)), colour)

    def paint_discs(self, centre_px: np.ndarray, radius_px: float, colour: Colour, blur_px: float) -> None:
        """Paint the mean of discs, which are one disc at s moments of an exposure.

        Args:
            centre_px: (s, 2) centres.
            radius_px: radius of the disc.
            colour: colour to paint.
            blur_px: standard deviation of the lens' blur.
        """
        reach = radius_px + 4 * blur_px
        region = self.region(centre_px.min(axis=0) - reach, centre_px.max(axis=0) + reach)
        if not region.empty:
            self.blend(region, disc_cover(region, centre_px, radius_px, blur_px), colour)


def disc_cover(region: Region, centre_px: np.ndarray, radius_px: float, blur_px: float) -> np.ndarray:
    """Return (h, w) float32 mean cover of a region's pixels by blurred discs at s centres (s, 2), px.

    The edge of a disc of a radius well above the blur is that of a straight edge under a Gaussian blur. It spans
    several pixels, so sampling at their centres keeps the disc's centre.
    """
    x, y = region.grid()
    total = np.zeros((y.size, x.size), np.float32)
    for centre in centre_px.astype(np.float32):
        inside = radius_px - np.hypot(x - centre[0], y - centre[1])
        total += erf(inside / np.float32(np.sqrt(2) * blur_px))
    return 0.5 + total / (2 * len(centre_px))


def _mix(plane: np.ndarray, cover: np.ndarray, value: float) -> None:
    mixed = plane + cover * (np.float32(value) - plane)
    plane[:] = np.clip(mixed + 0.5, 0, 255)
