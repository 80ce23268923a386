"""Look of a marker: the grey that separates it from its surroundings, and its look over time.

`window` and `windows` cut square windows out of a picture; beyond its border the last pixels are repeated. `Grey` is
the grey that markers are sought in: brightness, or how far a colour is from those around the markers. `Appearance` is
the look of the markers in it: bright or dark, how wide, how much they stand out.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np

from tracking.boxes import StartBoxes
from tracking.video import Frame

ENOUGH = 15.0
"""Grey levels by which each marker must stand out from most of what is around it for brightness to be used as it is."""
_BETTER = 1.5  # times that the colours must separate the worst marker more than brightness does …
_MUCH_BETTER = 2.0  # … and that they must where brightness would be enough
_FEWEST_TO_SPARE = 4  # markers of which one may be hidden in its box
_ALONE, _CLEAR = 0.5, 0.7  # shares from which a marker is as far off all around it, by brightness and by colour
_LARGE_PX = 30.0  # sides of boxes from which on half the resolution costs less than two brightnesses around a marker
_CORE, _RING = 0.5, (1.2, 1.8)  # radii in half sides of a box: its middle, and its surroundings
_COVERED = 1.1  # half sides of a box within which its own marker is seen
_SPAN = 10.0, 90.0  # percentiles of the colours around the markers that count as these
_MOST = 15.0, 85.0  # percentiles of what is around a marker: it may touch others
_NEARLY_ALL = 4.0, 96.0  # the same where it must touch none
_FULL = 180.0  # grey levels of a pixel as far off in colour as the markers are in the median

_KEEP_SIZE, _KEEP_CONTRAST = 0.9, 0.8  # weight that the known look keeps with every frame
_SIZES, _CONTRASTS = (0.4, 3.0), (0.1, 5.0)  # how far the look may wander from that in the start boxes
_SURROUND = (0.85, 1.2)  # ring at the rim of a box, in half sides
_WIDER, _CLEARER = 1.7, 2.0  # sides of a box that may be too small, and times the contrast that then tells
_SMALLEST_PX = 4.0
LEAST_CONTRAST = 1.0
"""Grey levels that a marker stands out by at least; else nothing could be a share of its contrast."""
FEWEST_ALIKE = 3
"""Markers that look alike, from which on they tell something of the others."""
REACH_OF_A_BOX = 0.6
"""Share of a box's side about its middle within which its marker lies."""
_LINE_PX = 2.0  # width of a ring's line at least
_HOLLOW, _STANDS_OUT = 2.0, 6.0  # times that a ring stands out more than its middle, and least grey levels of either


def window(luma: np.ndarray, column: int, row: int, reach: int) -> np.ndarray:
    """Cut (2 reach + 1, 2 reach + 1) uint8 out of the (h, w) picture, centred on one of its pixels."""
    height, width = luma.shape
    left, top, right, bottom = column - reach, row - reach, column + reach + 1, row + reach + 1
    if left >= 0 and top >= 0 and right <= width and bottom <= height:
        return luma[top:bottom, left:right]
    columns = np.clip(np.arange(left, right), 0, width - 1)
    rows = np.clip(np.arange(top, bottom), 0, height - 1)
    return luma[np.ix_(rows, columns)]


def windows(luma: np.ndarray, centre_px: np.ndarray, reach: int) -> tuple[np.ndarray, np.ndarray]:
    """Cut windows (k, 2 reach + 1, 2 reach + 1) float32 around places (k, 2); return them and their middles (k, 2)."""
    middle = np.rint(centre_px).astype(int)
    cut = [window(luma, column, row, reach) for column, row in middle.tolist()]
    side = 2 * reach + 1
    return np.array(cut, dtype=np.float32).reshape(-1, side, side), middle


@dataclass(frozen=True)
class Grey:
    """A map from the pixels of a frame to grey levels.

    Attributes:
        by_colour: how far the colour is from those around the markers, else brightness.
        around: two pairs of colour differences (U, V), between which those around the markers lie.
        gain: grey levels for one level of distance.
        lightness: the brightness between which that around the markers lies, where a marker may also be told by it.
        hole_px: width of the holes of markers that are rings, which are filled; negative where these are dark.
    """

    by_colour: bool = False
    around: tuple[tuple[float, float], tuple[float, float]] = ((128.0, 128.0), (128.0, 128.0))
    gain: float = 1.0
    lightness: tuple[float, float] = (0.0, 255.0)
    hole_px: float = 0.0

    def of(self, frame: Frame) -> np.ndarray:
        """Return the grey levels (h, w), uint8, of a frame."""
        return _filled(self._of_yuv(frame.yuv()) if self.by_colour else frame.luma, self.hole_px)

    def brightness_beside(self, frame: Frame) -> np.ndarray | None:
        """Return the brightness (h, w), uint8, of a frame whose markers are sought by colour; else None.

        A film keeps fewer colours than pixels, and compresses them more.
        """
        return frame.luma if self.by_colour else None

    def _of_yuv(self, yuv: np.ndarray) -> np.ndarray:
        levels = self._levels[yuv[..., 1], yuv[..., 2]]
        return levels if self.lightness == (0.0, 255.0) else np.maximum(levels, self._by_lightness[yuv[..., 0]])

    def as_array(self) -> np.ndarray:
        """Return it as numbers (9,), which `restored` takes back."""
        return np.array([self.by_colour, *self.around[0], *self.around[1], self.gain, *self.lightness, self.hole_px])

    @classmethod
    def restored(cls, kept: np.ndarray) -> "Grey":
        """Make it again of what `as_array` gave."""
        by_colour, u, v, other_u, other_v, gain, dark, light, hole_px = kept.tolist()
        return cls(bool(by_colour), ((u, v), (other_u, other_v)), gain, (dark, light), hole_px)

    @classmethod
    def of_boxes(cls, frame: Frame, boxes: StartBoxes, markers: Sequence[str]) -> "Grey":
        """Choose the grey for the markers in their start boxes, in the frame of these; rings are filled in it."""
        centre_px, side_px = boxes.centres_px(markers), boxes.sides_px(markers)
        grey = cls.chosen(frame, centre_px, side_px)
        hole_px = ring_holes_px(grey.of(frame), centre_px, side_px)
        apart_px = np.linalg.norm(centre_px[:, None] - centre_px[None], axis=2)
        nearest_px = float(apart_px[~np.eye(len(markers), dtype=bool)].min(initial=np.inf))
        return replace(grey, hole_px=hole_px) if nearest_px > 2 * abs(hole_px) else grey

    @classmethod
    def chosen(cls, frame: Frame, centre_px: np.ndarray, side_px: np.ndarray) -> "Grey":
        """Choose the grey in which markers at (m, 2), px, in boxes of (m,) sides, px, stand out from what is around.

        Brightness is chosen if it separates them all, unless colour does so far better: it is sharper, and costs
        nothing. Where neither does, a marker may stand out by either; else clearly by colour all of them but one, which
        may be hidden.
        """
        bright = _margins(frame.luma, centre_px, side_px)  # (2, m)
        large = float(np.min(side_px)) >= _LARGE_PX
        yuv = frame.yuv()
        hues = [_parts(yuv[..., channel], centre_px, side_px) for channel in (1, 2)]
        cores = np.array([[np.median(core) for core, _ in parts] for parts in hues]).T  # (m, 2)
        rings = np.array([np.concatenate([ring for _, ring in parts]) for parts in hues], float).T  # (p, 2)
        around = _ends(rings)
        off = _off_segment(cores, *np.array(around))
        gain = float(np.clip(_FULL / max(float(np.median(off)), 1.0), 1.0, 6.0))
        coloured = cls(True, around, gain)
        hue = _margins(coloured._of_yuv(yuv), centre_px, side_px)
        rings_luma = [ring for _, ring in _parts(yuv[..., 0], centre_px, side_px)]
        spans = np.array([np.percentile(ring, _SPAN) for ring in rings_luma])
        most, all_rings = np.percentile(np.concatenate(rings_luma), _SPAN), (spans[:, 0].min(), spans[:, 1].max())
        (margin, share), (hue_margin, hue_share) = bright.min(axis=1), hue.min(axis=1)  # the worst marker counts
        if margin >= ENOUGH:  # good enough, if colour, which no glint has, is not much better
            alone = large and share < _ALONE and hue_share >= max(_CLEAR, _BETTER * share)
            better = hue_margin >= ENOUGH and (alone or hue_margin >= max(_FULL / 2, _MUCH_BETTER * margin))
            return coloured if better else cls()
        if hue_margin >= max(ENOUGH, _BETTER * margin):
            return coloured
        for dark, light in (most, all_rings):
            either = replace(coloured, lightness=(float(dark), float(light)))
            if _margins(either._of_yuv(yuv), centre_px, side_px)[0].min() >= ENOUGH:
                return either
        others = np.sort(hue[0])[1:] if len(side_px) >= _FEWEST_TO_SPARE else hue[0]
        return coloured if others.min() >= _FULL / 2 else cls()

    @cached_property
    def _levels(self) -> np.ndarray:
        """Tabulate the grey levels (256, 256), uint8, of each pair of colour differences."""
        grid = np.stack(np.meshgrid(np.arange(256.0), np.arange(256.0), indexing="ij"), axis=2)
        return np.clip(self.gain * _off_segment(grid, *np.array(self.around)), 0, 255).astype(np.uint8)

    @cached_property
    def _by_lightness(self) -> np.ndarray:
        """Tabulate the grey levels (256,), uint8, of each brightness."""
        (dark, light), level = self.lightness, np.arange(256.0)
        return np.clip(self.gain * np.maximum(dark - level, level - light), 0, 255).astype(np.uint8)


def _filled(grey: np.ndarray, hole_px: float) -> np.ndarray:
    """Return a picture (h, w) in which holes of bright rings so wide are filled, of dark ones where it is negative."""
    if not hole_px:
        return grey
    way, disc = (cv2.MORPH_CLOSE if hole_px > 0 else cv2.MORPH_OPEN), round(abs(hole_px)) | 1
    return cv2.morphologyEx(grey, way, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (disc, disc)))


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


def lies_within(grey: np.ndarray, centre_px: np.ndarray, side_px: np.ndarray) -> np.ndarray:
    """Return (m,) bool, the markers whose grey lies well within the levels around them, not just hardly beyond.

    Args:
        grey: (h, w) uint8 picture in the grey that markers are sought in.
        centre_px: (m, 2) centres of their boxes, px.
        side_px: (m,) mean sides of the boxes, px.
    """
    return _margins(grey, centre_px, side_px)[0] < -ENOUGH


def stands_out(grey: np.ndarray, centre_px: np.ndarray, side_px: np.ndarray) -> np.ndarray:
    """Return (m,) bool, the markers whose grey lies well beyond the levels around them; arguments as `lies_within`.

    A marker nearly as bright as one of two levels around it does not: it has no rim there. Nor does one on a narrow
    tail that is brighter.
    """
    margin, share = _margins(grey, centre_px, side_px, _NEARLY_ALL)
    return (margin >= ENOUGH) & (share >= _ALONE)


def _margins(
    grey: np.ndarray, centre_px: np.ndarray, side_px: np.ndarray, around: tuple[float, float] = _MOST
) -> np.ndarray:
    """Measure the contrast of each marker, below 0 within the levels around it, and as a share of the largest, (2, m).

    The largest is that to the farthest level around the marker, between two percentiles of what is around it.
    """
    found = []
    for core, ring in _parts(grey, centre_px, side_px):
        low, high = np.percentile(ring, around)
        middle = float(np.median(core))
        margin = max(middle - high, low - middle)
        found.append((margin, margin / max(abs(middle - high), abs(low - middle), 1.0)))
    return np.array(found).T


@dataclass(frozen=True, eq=False)
class Appearance:
    """The look of m markers."""

    sign: np.ndarray  # (m,) +1 for a marker brighter than what surrounds it, -1 for a darker one
    diameter_px: np.ndarray  # (m,) of a disc of the same area
    contrast: np.ndarray  # (m,) how far its luma stands out, in steps of 1/255
    # (m,) how strongly the detector answers to it, in parts of its answer to a disc on a wide plain ground
    answer: np.ndarray

    def as_array(self) -> np.ndarray:
        """Return (4, m): sign, diameter, contrast and answer."""
        return np.stack([self.sign, self.diameter_px, self.contrast, self.answer])

    def of(self, which: np.ndarray) -> "Appearance":
        """Return the look of some of the markers, by (m,) bool or by number."""
        return Appearance(self.sign[which], self.diameter_px[which], self.contrast[which], self.answer[which])

    def seen(
        self, surely: np.ndarray, diameter_px: np.ndarray, contrast: np.ndarray, start: "Appearance"
    ) -> "Appearance":
        """Return the look after one more frame, from sizes and contrasts (m,) of the markers that are certain (m,).

        Light and distance change slowly, and only so far from the start; both may grow and shrink.
        """
        size = _moved(self.diameter_px, np.where(surely, diameter_px, self.diameter_px), _KEEP_SIZE)
        light = _moved(self.contrast, np.where(surely, contrast, self.contrast), _KEEP_CONTRAST)
        return replace(
            self,
            diameter_px=np.clip(size, _SIZES[0] * start.diameter_px, _SIZES[1] * start.diameter_px),
            contrast=np.clip(light, _CONTRASTS[0] * start.contrast, _CONTRASTS[1] * start.contrast),
        )


def _moved(old: np.ndarray, new: np.ndarray, keep: float) -> np.ndarray:
    return keep * old + (1 - keep) * new


def measure_appearance(luma: np.ndarray, centre_px: np.ndarray, box_px: np.ndarray) -> Appearance:
    """Measure the look of markers in a picture (h, w), in start boxes of (m,) mean sides around (m, 2).

    Whether a marker is bright or dark is found from the middle of its box against the darkest and the brightest quarter
    of a ring at the box' rim, since water and body may both be there; its area by how much light the box holds over
    that quarter. Where a wider ring shows much more contrast, the box is smaller than its marker.
    """
    rows = []
    for centre, side in zip(centre_px, box_px, strict=True):
        tight, wide = _look(luma, centre, side), _look(luma, centre, _WIDER * side)
        rows.append(wide if wide[2] > _CLEARER * tight[2] else tight)
    sign, diameter, contrast = np.array(rows).T
    return Appearance(sign, diameter, contrast, np.ones(len(sign)))


def _look(luma: np.ndarray, centre_px: np.ndarray, side_px: float) -> tuple[float, float, float]:
    half = max(side_px / 2, _SMALLEST_PX / 2)
    patch, middle = windows(luma, centre_px[None], int(np.ceil(_SURROUND[1] * half)))
    away = np.arange(patch.shape[1]) - patch.shape[1] // 2
    offset = centre_px - middle[0]
    distance = np.hypot(away[None, :] - offset[0], away[:, None] - offset[1])
    ring = patch[0][(distance > _SURROUND[0] * half) & (distance < _SURROUND[1] * half)]
    core = np.median(patch[0][distance < 0.3 * half + 1])
    dark, bright = np.percentile(ring, [25, 75])
    sign = 1.0 if core - dark >= bright - core else -1.0
    background = dark if sign > 0 else bright
    light = sign * (patch[0] - background)
    contrast = max(float(np.percentile(light[distance < half], 90)), LEAST_CONTRAST)
    area = float(np.clip(light[distance < 1.2 * half] / contrast, 0, 1).sum())
    return sign, max(2 * np.sqrt(area / np.pi), _SMALLEST_PX), contrast


def ring_radii(grey: np.ndarray, centre_px: np.ndarray, side_px: np.ndarray) -> np.ndarray:
    """Return (m,) the radius, px, of each marker that is a ring, negative where it is dark; 0 of one that is none.

    The middle of a ring stands out far less than a circle around it does.

    Args:
        grey: (h, w) picture.
        centre_px: (m, 2) centres of the boxes.
        side_px: (m,) their mean sides.
    """
    found = np.zeros(len(side_px))
    for number, (centre, side) in enumerate(zip(centre_px, side_px.tolist(), strict=True)):
        edge = REACH_OF_A_BOX * side
        reach = int(np.ceil(0.75 * side))
        column, row = np.rint(centre).astype(int).tolist()
        patch = window(grey, column, row, reach).astype(float)
        y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1]
        away = np.hypot(x, y)
        off = patch - np.median(patch[away > edge])
        inside = np.where(away <= edge, np.maximum(np.abs(off) - _STANDS_OUT, 0.0), 0.0)
        if not inside.any():
            continue
        away = np.hypot(x - np.average(x, weights=inside), y - np.average(y, weights=inside))
        radii = np.arange(1.5, edge, 0.5)
        around = np.array([off[(away >= radius - 0.75) & (away < radius + 0.75)].mean() for radius in radii])
        if not len(around):
            continue
        most = int(np.argmax(np.abs(around)))
        if abs(around[most]) > _HOLLOW * max(float(np.abs(off[away < 1.5]).mean()), _STANDS_OUT):
            found[number] = np.sign(around[most]) * radii[most]
    return found


def ring_holes_px(grey: np.ndarray, centre_px: np.ndarray, side_px: np.ndarray) -> float:
    """Return the width, px, of the holes of markers if most are rings, negative for dark rings; else 0.

    A dot on a base of its own is no ring, even if it looks like the ground beside the base: filled, rings stand out.
    Arguments as of `ring_radii`.
    """
    radii = ring_radii(grey, centre_px, side_px)
    are = radii != 0
    if np.count_nonzero(are) < max(FEWEST_ALIKE, len(radii) / 2):
        return 0.0
    width_px = 2 * float(np.median(np.abs(radii[are]))) - _LINE_PX
    hole_px = width_px if np.median(np.sign(radii[are])) > 0 else -width_px
    return hole_px if _margins(_filled(grey, hole_px), centre_px, side_px)[0].min() >= ENOUGH else 0.0
