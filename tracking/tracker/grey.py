"""The grey that markers are sought in: brightness, or how far a colour is from those around the markers."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from tracking.boxes import StartBoxes
from tracking.tracker.windows import windows
from tracking.video import Frame

ENOUGH = 15.0
"""Grey levels by which each marker must stand out from most of what is around it for brightness to be used as it is."""
_BETTER = 1.5  # times that the colours must separate the worst marker more than brightness does
_ALONE, _CLEAR = 0.5, 0.7  # shares from which a marker is as far off all around it, by brightness and by colour
_LARGE_PX = 30.0  # sides of boxes from which on half the resolution costs less than two brightnesses around a marker
_CORE, _RING = 0.5, (1.2, 1.8)  # radii in half sides of a box: its middle, and its surroundings
_COVERED = 1.1  # half sides of a box within which its own marker is seen
_SPAN = 10.0, 90.0  # percentiles of the colours around the markers that count as these
_MOST = 15.0, 85.0  # percentiles of what is around a marker: it may touch others
_FULL = 180.0  # grey levels of a pixel as far off in colour as the markers are in the median


@dataclass(frozen=True)
class Grey:
    """A map from the pixels of a frame to grey levels.

    Attributes:
        by_colour: how far the colour is from those around the markers, else brightness.
        around: two pairs of colour differences (U, V), between which those around the markers lie.
        gain: grey levels for one level of distance.
    """

    by_colour: bool = False
    around: tuple[tuple[float, float], tuple[float, float]] = ((128.0, 128.0), (128.0, 128.0))
    gain: float = 1.0

    def of(self, frame: Frame) -> np.ndarray:
        """Return the grey levels (h, w), uint8, of a frame."""
        if not self.by_colour:
            return frame.luma
        yuv = frame.yuv()
        return self._levels[yuv[..., 1], yuv[..., 2]]

    def as_array(self) -> np.ndarray:
        """Return it as numbers (6,), which `restored` takes back."""
        return np.array([self.by_colour, *self.around[0], *self.around[1], self.gain])

    @classmethod
    def restored(cls, kept: np.ndarray) -> "Grey":
        """Make it again of what `as_array` gave."""
        by_colour, *around, gain = kept.tolist()
        return cls(bool(by_colour), ((around[0], around[1]), (around[2], around[3])), gain)

    @classmethod
    def of_boxes(cls, frame: Frame, boxes: StartBoxes, markers: Sequence[str]) -> "Grey":
        """Choose the grey for the markers in their start boxes, in the frame of these."""
        sides = [(boxes.boxes[name].width + boxes.boxes[name].height) / 2 for name in markers]
        return cls.chosen(frame, boxes.centres_px(markers), np.array(sides))

    @classmethod
    def chosen(cls, frame: Frame, centre_px: np.ndarray, side_px: np.ndarray) -> "Grey":
        """Choose the grey in which markers at (m, 2), px, in boxes of (m,) sides, px, stand out from what is around.

        Brightness is chosen if it separates them all: it is sharper, and costs nothing.
        """
        by_luma = _separation(frame.luma, centre_px, side_px)
        large = float(np.min(side_px)) >= _LARGE_PX
        if by_luma.margin >= ENOUGH and (by_luma.share >= _ALONE or not large):
            return cls()
        yuv = frame.yuv()
        hues = [_parts(yuv[..., channel], centre_px, side_px) for channel in (1, 2)]
        cores = np.array([[np.median(core) for core, _ in parts] for parts in hues]).T  # (m, 2)
        rings = np.array([np.concatenate([ring for _, ring in parts]) for parts in hues], float).T  # (p, 2)
        around = _ends(rings)
        off = _off_segment(cores, *np.array(around))
        gain = float(np.clip(_FULL / max(float(np.median(off)), 1.0), 1.0, 6.0))
        coloured = cls(True, around, gain)
        by_colour = _separation(coloured._levels[yuv[..., 1], yuv[..., 2]], centre_px, side_px)
        better = by_colour.margin >= max(ENOUGH, _BETTER * by_luma.margin)
        if by_luma.margin >= ENOUGH:  # good enough, if colour is not much better
            better = by_colour.margin >= ENOUGH and by_colour.share >= max(_CLEAR, _BETTER * by_luma.share)
        return coloured if better else cls()

    @cached_property
    def _levels(self) -> np.ndarray:
        """Tabulate the grey levels (256, 256), uint8, of each pair of colour differences."""
        grid = np.stack(np.meshgrid(np.arange(256.0), np.arange(256.0), indexing="ij"), axis=2)
        return np.clip(self.gain * _off_segment(grid, *np.array(self.around)), 0, 255).astype(np.uint8)


def _ends(colours: np.ndarray) -> tuple[tuple[float, float], tuple[float, float]]:
    """Find two colours between which most of (p, 2) lie: body and water, with what a blurred rim makes of the two."""
    middle = np.median(colours, axis=0)
    _, _, axes = np.linalg.svd(colours - middle, full_matrices=False)
    along = (colours - middle) @ axes[0]
    low, high = (middle + share * axes[0] for share in np.percentile(along, _SPAN))
    return (float(low[0]), float(low[1])), (float(high[0]), float(high[1]))


def _off_segment(colours: np.ndarray, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Compute the distances (...) of colours (..., 2) from the segment between two."""
    way = other - one
    share = np.clip((colours - one) @ way / max(float(way @ way), 1e-9), 0, 1)
    return np.linalg.norm(colours - one - share[..., None] * way, axis=-1)


def _parts(grey: np.ndarray, centre_px: np.ndarray, side_px: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Take for each marker the values in the middle of its box, and in a ring around it that no other box covers."""
    parts = []
    for marker, (centre, side) in enumerate(zip(centre_px, side_px, strict=True)):
        half = side / 2
        patch, middle = windows(grey, centre[None], int(np.ceil(_RING[1] * half)) + 1)
        away = np.arange(patch.shape[1]) - patch.shape[1] // 2
        x, y = middle[0, 0] + away[None, :], middle[0, 1] + away[:, None]
        distance = np.hypot(x - centre[0], y - centre[1])
        ring = (distance > _RING[0] * half) & (distance < _RING[1] * half)
        for other in np.flatnonzero(np.arange(len(side_px)) != marker):
            ring &= np.hypot(x - centre_px[other, 0], y - centre_px[other, 1]) > _COVERED * side_px[other] / 2
        if not ring.any():
            ring = distance > _RING[0] * half
        parts.append((patch[0][distance <= max(_CORE * half, 1.0)], patch[0][ring]))
    return parts


class _Separation(NamedTuple):
    """The contrast of the worst marker: in grey levels, and as a share of that to the farthest level around it."""

    margin: float
    share: float


def _separation(grey: np.ndarray, centre_px: np.ndarray, side_px: np.ndarray) -> _Separation:
    """Measure how markers stand out in a picture (h, w); below 0 where one lies within the levels around it."""
    found = []
    for core, ring in _parts(grey, centre_px, side_px):
        low, high = np.percentile(ring, _MOST)
        middle = float(np.median(core))
        margin = max(middle - high, low - middle)
        found.append((margin, margin / max(abs(middle - high), abs(low - middle), 1.0)))
    margins, shares = zip(*found, strict=True)
    return _Separation(min(margins), min(shares))
