"""Blobs that could be markers: round, of one brightness, and set off from what surrounds them.

Difference-of-Gaussians peaks (Lowe, Distinctive image features, IJCV 60, 2004, section 3) by scikit-image, octave by
octave on ever smaller pictures, are only the places to look; each is then measured at full resolution.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import cv2
import numpy as np
from scipy.spatial import cKDTree
from skimage.feature import blob_dog
from skimage.measure import label, regionprops

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
