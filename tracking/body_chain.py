"""Blobs in a picture, and the chain of markers among them.

`find_blobs` finds what could be a marker: round, of one brightness, and set off from what surrounds it.
Difference-of-Gaussians peaks (Lowe, Distinctive image features, IJCV 60, 2004, section 3) by scikit-image, octave by
octave on ever smaller pictures, are only the places to look; each is then measured at full resolution.

`complete_bodies` assigns blobs to markers: the layout is laid over the blobs, from the head to the tail. Every ordered
pair of blobs is tried as the head's two front markers, which gives scale, heading and place. The other markers follow
one after another: those off the axis and the first behind the head are held by the head, the tail may bend at every
marker. Each step costs what it departs from the layout, in squared standard deviations; all partial bodies are carried
on together and the best are kept (a beam search). The spreads are those of the public tracks, whose tail root is up to
78 mm from the dorsal fin where the layout has 20, and whose last step is up to 1.6 times as long. Positions are complex
numbers x - iy: the layout's y points up where the image's points down.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, NamedTuple

import cv2
import numpy as np
from scipy.spatial import cKDTree
from skimage.feature import blob_dog
from skimage.measure import label, regionprops

# Blobs: scales, and what a marker looks like.
Polarity = Literal["bright", "dark"]

LARGE_PX = 2000
"""Width of a picture from which the search starts at half resolution: there no marker is under 8 px."""
OCTAVES = 4
SIGMA_PX = (1.2, 2.6)
"""Scales looked at in each octave: discs of 3.4 to 7.4 px across in its own pixels."""
LEAST_RESPONSE = 0.012
"""Least difference of Gaussians, of 1: discs of about 10 grey levels of contrast."""
LEAST_CONTRAST = 8.0
"""Least contrast between the disc and the ring around it, in grey levels."""
LOOKED_AT = 400
"""Largest number of places that are measured, those of the most contrast."""
DIAMETERS_PX = (5.0, 64.0)
LONGEST = 2.0
"""Ratio of the axes of a disc in motion blur; what is longer is a line."""
FULLEST = (0.8, 1.2)
"""Area over that of the ellipse with the same moments: 1 for a disc."""
SMOOTHED = 0.12
"""Sigma of the smoothing before a blob's outline is taken, in radii."""
SOFTEST_SHRINK = 0.75
"""Ratio of the diameters at 0.15 above a level and 0.1 below it: about 0.8 to 0.95 for a marker, 0.65 for a swell."""
LEVELS = (0.5, 0.65, 0.8)
"""Thresholds between surroundings (0) and middle (1); the higher ones part neighbours that touch."""

# The chain: what takes part, and how far a body may depart from the layout.
CANDIDATES = 110
"""Largest number of blobs that take part, those of the most contrast."""
BEAM = 4000
"""Largest number of partial bodies that are carried on."""
LATERAL_M = 0.01
"""Distance from the axis beyond which the head holds a marker."""
DIAMETERS_APART = (3.0, 40.0)
"""Bounds of the distance between the head's two front markers, in marker diameters."""
SIZE_SD = 0.25
"""Spread of the logarithm of a marker's diameter about that of the one before it: a robot's markers may differ."""
LEVEL_SD = 0.12
"""Spread of the logarithm of a marker's grey level about that of the head's two; its contrast depends on the water."""
ELONGATION_SD = 0.15
"""Spread of the logarithm of a marker's elongation about that of the head's two: motion blur of a few pixels."""
GATE = 3.0
"""Largest departure from the layout, in standard deviations."""


class Blob(NamedTuple):
    """One blob of a picture."""

    x: float  # centre, px, weighted by brightness
    y: float  # centre, px
    diameter_px: float  # diameter of the disc of the same area
    contrast: float  # grey levels between it and its surroundings, at least 0 whatever its polarity
    level: float  # grey level of its middle; of the negative for a dark blob, so always high for a marker
    elongation: float = 1.0  # ratio of its axes, 1 for a disc


def find_blobs(luma: np.ndarray, polarity: Polarity) -> tuple[Blob, ...]:
    """Find the blobs of one polarity in a picture, those of the most contrast first.

    Args:
        luma: (h, w) bytes.
        polarity: whether the blobs are bright or dark.
    """
    upright = luma if polarity == "bright" else 255 - luma
    measured = (_measure(upright, x, y, radius) for x, y, radius in _places(upright))
    blobs = sorted((blob for blob in measured if blob is not None), key=lambda blob: -blob.contrast)
    return tuple(_each_once(blobs))


def _places(luma: np.ndarray) -> list[tuple[float, float, float]]:
    """Return x, y and radius (px) of the places to look at."""
    factor = 2 if luma.shape[1] > LARGE_PX else 1
    found: list[np.ndarray] = []
    for _ in range(OCTAVES):
        size = luma.shape[1] // factor, luma.shape[0] // factor
        small = cv2.resize(luma, size, interpolation=cv2.INTER_AREA).astype(np.float32) / 255
        if min(small.shape) >= 16:
            found.append(_places_in_octave(small, factor))
        factor *= 2
    places = np.concatenate(found) if found else np.empty((0, 4))
    strongest = np.argsort(-places[:, 3], kind="stable")[:LOOKED_AT]
    return [(x, y, radius) for x, y, radius in places[strongest, :3].tolist()]


def _places_in_octave(small: np.ndarray, factor: int) -> np.ndarray:
    """Return (b, 4) x, y, radius and contrast of the peaks in a shrunken picture; px of the whole picture.

    Args:
        small: (h, w) the shrunken picture.
        factor: ratio of the whole picture's size to that of `small`.
    """
    low, high = SIGMA_PX
    peaks = blob_dog(small, min_sigma=low, max_sigma=high, sigma_ratio=1.5, threshold=LEAST_RESPONSE, overlap=0.9)
    y, x, sigma = peaks.T
    radius = np.sqrt(2) * sigma
    turn = np.linspace(0, 2 * np.pi, 8, endpoint=False)[:, None]
    ring_x = np.clip(np.rint(x + 2 * radius * np.cos(turn)), 0, small.shape[1] - 1).astype(int)  # (8, b)
    ring_y = np.clip(np.rint(y + 2 * radius * np.sin(turn)), 0, small.shape[0] - 1).astype(int)
    contrast = small[y.astype(int), x.astype(int)] - np.median(small[ring_y, ring_x], axis=0)
    centre = factor * (peaks[:, 1::-1] + 0.5) - 0.5  # centres of pixels, before and after the change of size
    return np.column_stack([centre, factor * radius, contrast])


def _measure(luma: np.ndarray, x: float, y: float, radius: float) -> Blob | None:
    """Measure the bright blob at a place, or return None if what is there is no disc set off from its surroundings."""
    left, top = (max(0, int(at - 3 * radius - 2)) for at in (x, y))
    patch = luma[top : int(y + 3 * radius + 3), left : int(x + 3 * radius + 3)].astype(np.float32)
    rows, columns = np.ogrid[: patch.shape[0], : patch.shape[1]]
    away = np.hypot(columns - (x - left), rows - (y - top))
    level = float(np.mean(patch[away <= max(0.5 * radius, 1.0)]))
    surroundings = float(np.median(patch[(away > 1.6 * radius) & (away < 3 * radius)]))
    contrast = level - surroundings
    if contrast < LEAST_CONTRAST:
        return None
    patch = (patch - surroundings) / contrast
    smooth = cv2.GaussianBlur(patch, (0, 0), SMOOTHED * radius)
    middle = min(round(y - top), len(patch) - 1), min(round(x - left), patch.shape[1] - 1)
    for height in LEVELS:
        disc = _part(smooth, middle, height)
        if disc is not None and _is_disc(disc) and not _is_soft(smooth, middle, height):
            region = regionprops(disc.astype(np.uint8), intensity_image=np.clip(patch, 0, None))[0]
            row, column = region.centroid_weighted
            diameter, elongation = region.equivalent_diameter_area, region.axis_major_length / region.axis_minor_length
            return Blob(left + float(column), top + float(row), float(diameter), contrast, level, float(elongation))
    return None


def _part(patch: np.ndarray, pixel: tuple[int, int], level: float) -> np.ndarray | None:
    """Return the connected part (h, w) above a level around a pixel, or None if it reaches the patch's edge."""
    parts = label(patch > level, connectivity=1)
    part = parts == parts[pixel]
    edge = part[0].any() or part[-1].any() or part[:, 0].any() or part[:, -1].any()
    return None if edge or parts[pixel] == 0 else part


def _is_disc(part: np.ndarray) -> bool:
    """Tell whether a part is about as long as wide, and filled like an ellipse."""
    least, most = DIAMETERS_PX
    if not least**2 <= part.sum() * 4 / np.pi <= most**2:
        return False
    region = regionprops(part.astype(np.uint8))[0]
    major, minor = region.axis_major_length, region.axis_minor_length
    full = region.area / (np.pi / 4 * major * max(minor, 1e-9))
    return bool(major <= LONGEST * minor and FULLEST[0] <= full <= FULLEST[1])


def _is_soft(patch: np.ndarray, pixel: tuple[int, int], level: float) -> bool:
    """Tell whether the part shrinks much while the level rises: a swell of the water, not a marker with an edge."""
    lower, upper = (_part(patch, pixel, level + step) for step in (-0.1, 0.15))
    if upper is None:
        return True
    if lower is None:
        return False
    return bool(np.sqrt(upper.sum() / lower.sum()) < SOFTEST_SHRINK)


def _each_once(blobs: list[Blob]) -> list[Blob]:
    """Drop the blobs that another one, of more contrast, already covers."""
    if not blobs:
        return []
    tree = cKDTree([blob[:2] for blob in blobs])
    covered: set[int] = set()
    for number, blob in enumerate(blobs):
        if number not in covered:
            covered.update(near for near in tree.query_ball_point(blob[:2], blob.diameter_px / 2) if near > number)
    return [blob for number, blob in enumerate(blobs) if number not in covered]


# The chain.


@dataclass(frozen=True)
class ChainSpread:
    """Standard deviations of a step: position across (m), logarithm of its length about `stretch`, and bend."""

    length: float = np.inf
    bend_deg: float = np.inf
    place_m: float = np.inf
    stretch: float = 1.0


RIGIDLY = ChainSpread(place_m=0.012)
"""Spread of a marker off the axis, which the head holds."""
BY_THE_HEAD = ChainSpread(length=0.06, bend_deg=7.0, stretch=0.96)
"""Spread of the first marker behind the head's two front markers."""
AT_THE_ROOT = ChainSpread(place_m=0.027)
"""Spread of the marker that the first piece of the tail holds."""
BY_THE_TAIL = ChainSpread(length=0.14, bend_deg=18.0, stretch=1.03)
AT_THE_END = ChainSpread(length=0.17, bend_deg=18.0, stretch=1.25)
"""Spread of the last marker, which the fin holds."""


@dataclass(frozen=True)
class ChainStep:
    """One marker to place: how freely it moves, the marker before it, and the two whose direction it should keep."""

    marker: int
    spread: ChainSpread
    before: int
    along: tuple[int, int]


@dataclass(frozen=True)
class Bodies:
    """Complete bodies, the best first."""

    blobs: np.ndarray  # (b, m) index of the blob of each marker
    cost: np.ndarray  # (b,) half the sum of the squared departures, in standard deviations


def body_steps(layout_m: np.ndarray) -> tuple[int, int, tuple[ChainStep, ...]]:
    """Return the head's two front markers, and the steps to all others, for a layout (m, 2) along +x, m.

    Raises:
        ValueError: fewer than four markers on the axis, too few to distinguish a body from scattered blobs.
    """
    axis = [int(k) for k in np.argsort(layout_m[:, 0], kind="stable") if abs(layout_m[k, 1]) <= LATERAL_M]
    if len(axis) < 4:
        raise ValueError(f"{len(axis)} markers along the axis; at least 4 are needed to find a body by its layout")
    lateral = [k for k in range(len(layout_m)) if k not in axis]
    nose, neck, root, first, *tail = axis
    steps = [ChainStep(root, BY_THE_HEAD, neck, (nose, neck))]
    steps += [ChainStep(k, RIGIDLY, neck, (nose, neck)) for k in lateral]
    steps += [ChainStep(first, AT_THE_ROOT, root, (neck, root))]
    # The tail's first direction is measured against the head's: its root is to the side in the public tracks.
    along = [(neck, root), *pairwise(axis[3:])]
    held = [BY_THE_TAIL] * (len(tail) - 1) + [AT_THE_END]
    steps += [ChainStep(*step) for step in zip(tail, held, axis[3:], along, strict=False)]
    return nose, neck, tuple(steps)


def complete_bodies(blobs: Sequence[Blob], layout_m: np.ndarray) -> Bodies:
    """Find all ways to see the layout in the blobs of one polarity, the best first.

    Args:
        blobs: the blobs, those of the most contrast first.
        layout_m: (m, 2) marker positions on the straight robot, m.
    """
    appearance = np.array([(b.x, b.y, b.diameter_px, b.level, b.elongation) for b in blobs[:CANDIDATES]]).reshape(-1, 5)
    nose, neck, steps = body_steps(layout_m)
    if len(appearance) < len(layout_m):
        return Bodies(np.empty((0, len(layout_m)), dtype=int), np.empty(0))
    partial = _Partial.heads(appearance, layout_m, nose, neck)
    for step in steps:
        partial = partial.carry_on(step)
    order = np.argsort(partial.cost, kind="stable")
    return Bodies(partial.blobs[order], partial.cost[order])


@dataclass(frozen=True)
class FoundStep:
    """One step along a body that was seen."""

    step: ChainStep  # which
    off: float  # how far it departs from the layout, in standard deviations, the largest of its parts
    length_m: float  # found, at the scale of the head
    bend_deg: float  # found, to the direction it should keep


def found_steps(centre_px: np.ndarray, layout_m: np.ndarray) -> tuple[FoundStep, ...]:
    """Compare every step behind the head's two front markers with the layout.

    Args:
        centre_px: (m, 2) marker positions in a picture, px.
        layout_m: (m, 2) marker positions on the straight robot, m.

    Raises:
        ValueError: fewer than four markers on the axis.
    """
    nose, neck, steps = body_steps(layout_m)
    at, count = centre_px[:, 0] - 1j * centre_px[:, 1], len(layout_m)
    layout = layout_m[:, 0] + 1j * layout_m[:, 1]
    body = _Partial(at, np.zeros((count, 3)), layout, (nose, neck), np.arange(count)[None], np.zeros(1))
    taken = []
    for step in steps:
        moved = complex(body.moved(step)[0, step.marker])
        off = float(np.abs(body.off_place(step)[:, 0, step.marker]).max())
        taken.append(FoundStep(step, off, abs(moved), float(np.rad2deg(np.angle(moved)))))
    return tuple(taken)


@dataclass(frozen=True)
class _Partial:
    """Partial bodies: the blob of each marker (b, m), -1 where not yet placed, and costs (b,)."""

    at: np.ndarray  # (n,) complex places of the blobs, px
    look: np.ndarray  # (n, 3) logarithms of diameter, level and elongation
    layout: np.ndarray  # (m,) complex places of the layout, m
    front: tuple[int, int]
    blobs: np.ndarray
    cost: np.ndarray

    @classmethod
    def heads(cls, appearance: np.ndarray, layout_m: np.ndarray, nose: int, neck: int) -> _Partial:
        """Take every ordered pair of similar blobs as the head's two front markers."""
        at = appearance[:, 0] - 1j * appearance[:, 1]
        look = np.log(appearance[:, 2:])
        apart = np.abs(at[:, None] - at) / np.sqrt(appearance[:, None, 2] * appearance[:, 2])
        difference = (look[:, None] - look) / (np.sqrt(2) * np.array([SIZE_SD, LEVEL_SD, ELONGATION_SD]))  # (n, n, 3)
        low, high = DIAMETERS_APART
        first, second = np.nonzero((apart > low) & (apart < high) & (np.abs(difference).max(axis=2) < GATE))
        blobs = np.full((len(first), len(layout_m)), -1)
        blobs[:, nose], blobs[:, neck] = first, second
        cost = (difference[first, second] ** 2).sum(axis=1) / 2
        return cls(at, look, layout_m[:, 0] + 1j * layout_m[:, 1], (nose, neck), blobs, cost)

    def carry_on(self, step: ChainStep) -> _Partial:
        """Return the partial bodies with one more marker, placed on every blob that the step allows."""
        off = np.concatenate([self.off_place(step), self._off_look(step)], axis=0)  # (d, b, n)
        taken = (self.blobs[:, :, None] == np.arange(len(self.at))).any(axis=1)  # (b, n)
        allowed = (np.abs(off) < GATE).all(axis=0) & ~taken
        body, blob = np.nonzero(allowed)
        cost = self.cost[body] + (off[:, body, blob] ** 2).sum(axis=0) / 2
        kept = np.argsort(cost, kind="stable")[:BEAM]
        blobs = self.blobs[body[kept]]
        blobs[:, step.marker] = blob[kept]
        return _Partial(self.at, self.look, self.layout, self.front, blobs, cost[kept])

    def moved(self, step: ChainStep) -> np.ndarray:
        """Return the step to every blob (b, n), m: along (real) and across the direction to keep."""
        before = self.at[self.blobs[:, step.before]]  # (b,)
        behind, front = (self.at[self.blobs[:, k]] for k in step.along)
        nose, neck = (self.at[self.blobs[:, k]] for k in self.front)
        metre = np.abs(neck - nose) / abs(self.layout[self.front[1]] - self.layout[self.front[0]])  # (b,) px
        ahead = (front - behind) / np.abs(front - behind)  # (b,) the direction to keep
        return (self.at - before[:, None]) / (metre * ahead)[:, None]

    def off_place(self, step: ChainStep) -> np.ndarray:
        """Return the departures of every blob from the step (d, b, n), in standard deviations."""
        spread, taken = step.spread, self.moved(step)  # (b, n)
        wanted = self.layout[step.marker] - self.layout[step.before]
        if np.isfinite(spread.place_m):
            off = (taken - wanted) / spread.place_m
            return np.stack([np.abs(off)])
        with np.errstate(divide="ignore"):
            length = np.log(np.abs(taken) / (abs(wanted) * spread.stretch)) / spread.length
        bend = np.rad2deg(np.angle(np.where(taken == 0, 1, taken))) / spread.bend_deg
        return np.stack([length, bend])

    def _off_look(self, step: ChainStep) -> np.ndarray:
        """Return the departures in diameter, level and elongation (3, b, n), in standard deviations."""
        size = self.look[:, 0] - self.look[self.blobs[:, step.before], 0][:, None]
        usual = self.look[self.blobs[:, self.front], 1:].mean(axis=1)  # (b, 2)
        level, elongation = np.moveaxis(self.look[:, 1:] - usual[:, None], 2, 0)  # (b, n) each
        return np.stack([size / SIZE_SD, level / LEVEL_SD, elongation / ELONGATION_SD])
