"""Spots: places in a small window that look like a marker, and the sub-pixel centre of a marker."""

from dataclasses import dataclass
from functools import lru_cache
from math import ceil

import cv2
import numpy as np
from scipy.ndimage import binary_dilation, binary_fill_holes, gaussian_filter1d

from tracking.appearance import Appearance, window, windows

_WIDTHS = (0.25, 0.42)  # widths of the two Gaussians, in diameters
_FAINTEST = 0.3  # share of the response that a marker of known contrast gives
_LARGE_PX = 22.0  # wider markers are handled apart from narrower ones
_SIGMAS = 2.5  # a Gaussian's kernel reaches so far
_RIVALS = 12  # spots in one window at most, the strongest
_ROUNDS = 3, 5  # rounds of the centroid, each centred on the one before; the second number is for streaks
_MARGIN_PX = 1.0  # excess width of the centroid's disc over the marker
_FLOOR = 0.1  # share of the known contrast below which light does not count
_RING = (1.5, 1.4)  # the background is a ring from this many px beyond the rim to this many radii and as many px
_PARTS = (0.25, 0.7)  # quantiles of the ring's light that are the level of body or water, and that of the other
_WIDE_PX = 14.0  # wider markers show that they are lit unevenly
_FULL_LIGHT = 90  # percentile of the light in the middle of a wide marker that is its contrast, as at the start
_STEEP = 3.0  # how fast a pixel of a wide marker comes to count, from a third of its light to two thirds
_REACH = 1.25  # radii and the px of the ring: within them light counts for the size
_SECOND = 0.25  # share of the known contrast from which what is around a marker has a second level
_SECOND_AT_FIRST = 0.4  # the same while its motion is not known: a streak has light on two sides
_MOST_BEHIND = 0.65  # largest share of the known contrast that lies behind: a pale bar in front of a marker does not
_DIRECTIONS = 24  # directions in which the light behind a marker is measured
_BLURRED = 1.0  # directions by which that light is blurred
_TINY = 1e-9  # so that nothing is divided by 0
_SLACK_PX = 4  # excess size of a window
_FAST = 0.5  # diameters a frame, from which on a marker is drawn out
_LONGEST = 2.0  # diameters of a streak
_HOLE, _SOFT_PX = 0.6, 2  # share of the known contrast below which a place is dark, and the soft rim of such a hole
_INNER = 0.7  # radii within which holes are looked for
_CORE = 0.5  # share of a streak that is measured: its ends are faint, and lie on the blurred rim of the body
_PALER = 3.2  # a disc smeared over q diameters is answered exp(-q^2 / 3.2) as strongly, to 5 % up to q = 1.5
# In the middle of a disc of contrast 1:
_DISC_RESPONSE = float(np.exp(-1 / (8 * _WIDTHS[1] ** 2)) - np.exp(-1 / (8 * _WIDTHS[0] ** 2)))


@dataclass(frozen=True, eq=False)
class Spots:
    """Places that look like a marker."""

    position_px: np.ndarray  # (c, 2) to a pixel
    strength: np.ndarray  # (c,) of the response, 1 where it is that of the marker looked for
    mismatch: np.ndarray | None = None  # (m, c) from 0 to 1: in the hue of another marker than each; None: all alike

    def away_from(self, taken_px: np.ndarray, apart_px: float) -> "Spots":
        """Return the spots at least that far from some places (o, 2)."""
        distance = np.linalg.norm(self.position_px[:, None] - taken_px[None], axis=2)  # (c, o)
        free = distance.min(axis=1, initial=np.inf) >= apart_px
        return Spots(self.position_px[free], self.strength[free])


@dataclass(frozen=True, eq=False)
class Streaks:
    """Streaks of k markers, drawn out by their motion while the shutter is open."""

    along: np.ndarray  # (k, 2) unit vectors
    core_px: np.ndarray  # (k,) length of the line to measure around
    diameters: np.ndarray  # (k,) how far, in diameters of the marker

    @classmethod
    def of(cls, velocity_px: np.ndarray, diameter_px: np.ndarray, shutter: float) -> "Streaks":
        """Make those of markers of (k,) diameters and (k, 2) px a frame, for a shutter open that share of a frame."""
        speed = np.linalg.norm(velocity_px, axis=1)
        drawn = np.minimum(shutter * speed / diameter_px, _LONGEST)
        drawn[speed < _FAST * diameter_px] = 0.0
        return cls(velocity_px / np.maximum(speed, _TINY)[:, None], _CORE * drawn * diameter_px, drawn)

    def some(self, which: np.ndarray) -> "Streaks":
        """Return those of some of the markers, by (k,) bool or by number."""
        return Streaks(self.along[which], self.core_px[which], self.diameters[which])

    @property
    def thinner(self) -> np.ndarray:
        """(k,) by which the light in the middle is fainter."""
        return np.maximum(self.diameters, 1.0)


def find_spots(
    luma: np.ndarray, centre_px: np.ndarray, reach_px: np.ndarray, look: Appearance, streaks: Streaks | None = None
) -> Spots:
    """Find all spots within reach (k,) of the places (k, 2) where k markers of that look are expected, each once.

    A difference of two Gaussians as wide as the marker answers to a disc of its size and not to a slope of the
    brightness; its local maxima are the spots. To a streak of up to 1.5 diameters it answers in the middle, but less.
    """
    places = np.rint(centre_px).astype(int).tolist()
    full = look.contrast * look.answer
    if streaks is not None:
        full = full * np.exp(-(streaks.diameters**2) / _PALER)
    searches = zip(places, reach_px.tolist(), look.sign, look.diameter_px.tolist(), full, strict=True)
    found = np.concatenate([np.empty((0, 3)), *(_in_window(luma, *item) for item in searches)])
    position, strength = found[:, :2], found[:, 2]
    inside = ((position >= 0) & (position < luma.shape[::-1])).all(axis=1)
    return _each_once(position[inside], strength[inside], float(np.min(look.diameter_px, initial=np.inf)) / 2)


def strongest_answer(
    luma: np.ndarray, centre_px: np.ndarray, reach_px: int, sign: float, diameter_px: float
) -> np.ndarray:
    """Return (k,) the strongest answer to a marker of that look within reach of each place (k, 2), in luma."""
    margin = int(np.ceil(diameter_px)) + 1
    inner = slice(margin, -margin)
    places = np.rint(centre_px).astype(int).tolist()
    patches = (window(luma, column, row, reach_px + margin) for column, row in places)
    return np.array([float(response_to(patch, sign, diameter_px)[inner, inner].max()) for patch in patches])


def _in_window(
    luma: np.ndarray, place: tuple[int, int], reach: float, sign: float, diameter: float, contrast: float
) -> np.ndarray:
    """Return (c, 3) x, y and strength of the spots around a pixel, the strongest at most."""
    step = 2 if diameter > _LARGE_PX else 1  # large markers are sought at half the resolution
    margin = ceil(diameter / step)
    half = ceil(reach / step) + margin
    patch = window(luma, *place, step * half)
    if step == 2:
        patch = cv2.resize(np.ascontiguousarray(patch[:-1, :-1]), None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    response = response_to(patch, sign / contrast, diameter / step)
    side = max(int(diameter / step / 2) | 1, 3)
    inner = slice(margin, -margin)
    sought = response[inner, inner]
    highest = cv2.dilate(response, _square(side))[inner, inner]
    rows, columns = np.nonzero((sought == highest) & (sought > _FAINTEST))
    strength = sought[rows, columns]
    if len(strength) > 1:
        strongest = np.argsort(-strength)[:_RIVALS]
        rows, columns, strength = rows[strongest], columns[strongest], strength[strongest]
    spots = np.empty((len(strength), 3))
    for axis, along in enumerate((columns, rows)):
        spots[:, axis] = step * (along + (margin - half)) + (place[axis] + (step - 1) / 2)
    spots[:, 2] = strength
    return spots


@lru_cache
def _square(side: int) -> np.ndarray:
    return np.ones((side, side), np.uint8)


def response_to(patch: np.ndarray, gain: float, diameter: float) -> np.ndarray:
    """Return the two Gaussians' answer in every pixel of a patch: in the middle of a disc `gain` times its contrast."""
    plain = patch.astype(np.float32)
    widths = [width * diameter for width in _WIDTHS]
    inner, outer = (cv2.GaussianBlur(plain, (2 * ceil(_SIGMAS * sigma) + 1,) * 2, sigma) for sigma in widths)
    return cv2.subtract(inner, outer, dst=inner) * np.float32(gain / _DISC_RESPONSE)


def _each_once(position: np.ndarray, strength: np.ndarray, apart_px: float) -> Spots:
    """Keep of spots closer than that only the strongest: windows overlap."""
    order = np.argsort(-strength)
    position, strength = position[order], strength[order]
    distance = np.linalg.norm(position[:, None] - position[None], axis=2)
    keep: list[int] = []
    for index in range(len(position)):
        if not keep or distance[index, keep].min() > apart_px:
            keep.append(index)
    return Spots(position[keep], strength[keep])


@dataclass(frozen=True, eq=False)
class Centres:
    """Markers measured to a fraction of a pixel."""

    position_px: np.ndarray  # (k, 2)
    diameter_px: np.ndarray  # (k,) of a disc of the same light
    contrast: np.ndarray  # (k,) how far each stands out
    streak_px2: np.ndarray  # (k,) squared length of its streak, as far as its light tells; nan for slow ones


def measure_centres(
    luma: np.ndarray,
    position_px: np.ndarray,
    others_px: np.ndarray,
    look: Appearance,
    streaks: Streaks | None = None,
) -> Centres:
    """Take centroids of light over the background, in a disc hardly wider than each marker, on its side of neighbours.

    The disc is shifted onto the centroid a few times, from places (k, 2) right to a pixel or two; a marker in a disc of
    its own width draws it to its middle. A glint on the rim then hardly counts, nor does light beyond what the marker
    is known to have. Half-way to another of all markers (o, 2) the disc ends: its centroid is to be that of what is
    left of a disc. For a streak it is drawn out as far; size and contrast are those of the marker at rest, whose light
    it has.
    """
    centres = Centres(position_px.astype(float), *np.full((3, len(position_px)), np.nan))
    large = look.diameter_px > _LARGE_PX
    drawn = np.zeros(len(large), bool) if streaks is None else streaks.diameters > 0
    for group in (large & ~drawn, ~large & ~drawn, drawn):  # a window is as wide as the widest needs it
        if group.any():
            own = streaks.some(group) if streaks is not None and (group & drawn).any() else None
            second = _SECOND_AT_FIRST if streaks is None else _SECOND
            found = _centres_of(luma, centres.position_px[group], others_px, look.of(group), own, second)
            centres.position_px[group], centres.diameter_px[group], centres.contrast[group] = found[:3]
            if own is not None:
                centres.streak_px2[group] = found[3]
    return centres


def _centres_of(
    luma: np.ndarray,
    position_px: np.ndarray,
    others_px: np.ndarray,
    look: Appearance,
    streaks: Streaks | None,
    second: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray | None]:
    """Measure centres as `measure_centres`, of markers of about one size; return the fields of `Centres`.

    From the share `second` of a marker's contrast on, what is around it has a second level.
    """
    radius = (look.diameter_px / 2).astype(np.float32)[:, None, None]
    thinner = 1.0 if streaks is None else streaks.thinner
    known = (look.contrast / thinner).astype(np.float32)[:, None, None]
    longer = 0.0 if streaks is None else float(streaks.core_px.max()) / 2
    reach = ceil(_RING[1] * float(radius.max()) + _RING[0] + longer) + _SLACK_PX
    away = np.arange(-reach, reach + 1, dtype=np.float32)
    patch, middle = windows(luma, position_px, reach)
    offset = (position_px - middle).astype(np.float32)  # (k, 2)
    x, y, distance = _from(offset, away, streaks)
    mine = _own_side(position_px, others_px, x, y, reach)
    bright = patch if (look.sign > 0).all() else look.sign.astype(np.float32)[:, None, None] * patch
    ring = (distance > radius + _RING[0]) & (distance < _RING[1] * radius + _RING[0]) & mine
    background, other = (level[:, None, None] for level in _levels(bright, ring))
    light = (bright - background) * mine
    _fill_holes(light, known, distance < _INNER * radius)
    core, wide = distance < 0.6 * radius + 1, look.diameter_px > _WIDE_PX
    peak = (light * core).max(axis=(1, 2))
    for marker in np.flatnonzero(wide).tolist():
        peak[marker] = max(float(np.percentile(light[marker][core[marker]], _FULL_LIGHT)), 1.0)
    lit = light / np.maximum(peak, 1.0)[:, None, None]
    two = (other - background > second * known)[:, 0, 0]
    if streaks is None and two.any():
        behind = _light_behind(light[two], ring[two], x[two], y[two], known[two])
        lit[two] = (light[two] - behind) / np.maximum(peak[two, None, None] - behind, 1.0)
        light[two] = known[two] * (light[two] - behind) / (known[two] - behind)
    steep = np.where(wide, _STEEP, 1.0).astype(np.float32)[:, None, None]
    floor, full = np.maximum(0.5 - 0.5 / steep, _FLOOR), 0.5 + 0.5 / steep  # shares of the known contrast
    counted = np.clip(light, floor * known, full * known) - floor * known
    rim = radius + (_MARGIN_PX + 0.5)
    cut = (~mine & (distance < rim)).any(axis=(1, 2))
    for _ in range(_ROUNDS[streaks is not None]):
        weight = np.clip(rim - distance, 0, 1)
        weight *= counted
        shift = _centroid(weight, x, y)
        if cut.any():  # what a neighbour hides of a disc draws its centroid away from it
            disc = np.clip(radius[cut] + 0.5 - distance[cut], 0, 1) * mine[cut]
            shift[cut] -= _centroid(disc, x[cut], y[cut])
        offset = offset + shift
        x, y, distance = _from(offset, away, streaks)
    streak = None if streaks is None else _streak_px2(weight, x, y, streaks.along.astype(np.float32))
    share = np.clip(0.5 + steep * (lit - 0.5), 0, 1) * (distance < _REACH * radius + _RING[0])
    return middle + offset, 2 * np.sqrt(share.sum(axis=(1, 2)) / (np.pi * thinner)), thinner * peak, streak


def _light_behind(light: np.ndarray, ring: np.ndarray, x: np.ndarray, y: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Return the light (k, s, s) of what is behind each pixel of a marker: the least of the ring in its direction.

    A dark nose on the tip of a bright body lies half over water, which is darker than the body too; with one level for
    both its rim is put too far out over the water. On a base of its own a marker has the base behind it all around.
    """
    turn = np.arctan2(y, x) / (2 * np.pi) * _DIRECTIONS
    sector = np.floor(turn).astype(int)
    rows = np.arange(len(light))[:, None, None]
    place = (sector % _DIRECTIONS + _DIRECTIONS * rows).ravel()
    least = np.full(len(light) * _DIRECTIONS, np.inf)
    np.minimum.at(least, place, np.where(ring, light, np.inf).ravel())
    around = np.where(np.isfinite(least), least, 0.0).reshape(-1, _DIRECTIONS)
    level = np.clip(gaussian_filter1d(around, _BLURRED, mode="wrap"), 0, _MOST_BEHIND * known[:, :, 0])
    beyond = turn - sector - 0.5  # the middle of the sector, and the next one on that side
    near = sector + np.where(beyond < 0, -1, 1)
    here, there = (level[rows, number % _DIRECTIONS] for number in (sector, near))
    return (here + np.abs(beyond) * (there - here)).astype(np.float32)


def _fill_holes(light: np.ndarray, known: np.ndarray, inner: np.ndarray) -> None:
    """Fill enclosed dark places in markers (k, s, s), such as the highlight on a ball. `inner` is their middle."""
    dark = light < _HOLE * known
    for marker in np.flatnonzero((dark & inner).any(axis=(1, 2))).tolist():
        holes = binary_fill_holes(~dark[marker]) & dark[marker]
        soft = binary_dilation(holes, iterations=_SOFT_PX) & (light[marker] < known[marker])
        light[marker] = np.where(soft, known[marker], light[marker])


def _centroid(weight: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return (k, 2) of windows (k, s, s)."""
    columns, rows = weight.sum(axis=1), weight.sum(axis=2)
    moment = np.stack([(columns * x[:, 0]).sum(axis=1), (rows * y[:, :, 0]).sum(axis=1)], axis=1)
    return moment / np.maximum(columns.sum(axis=1), _TINY)[:, None]


def _streak_px2(weight: np.ndarray, x: np.ndarray, y: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Return (k,) the squared length of the streak of a round thing: 12 times its variance along less that across."""
    ahead, aside = along[:, 0, None, None], along[:, 1, None, None]
    far, wide = x * ahead + y * aside, y * ahead - x * aside
    return 12 * (weight * (far**2 - wide**2)).sum(axis=(1, 2)) / np.maximum(weight.sum(axis=(1, 2)), _TINY)


def _from(offset: np.ndarray, away: np.ndarray, streaks: Streaks | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return x (k, 1, s), y (k, s, 1) and distance (k, s, s) of a window's pixels from a place (k, 2) off its middle.

    From a streak it is that from the core of the line along which its middle moved.
    """
    x, y = away[None, None, :] - offset[:, 0, None, None], away[None, :, None] - offset[:, 1, None, None]
    distance = x * x + y * y
    if streaks is not None:
        ahead = streaks.along.astype(np.float32)
        far = np.abs(x * ahead[:, 0, None, None] + y * ahead[:, 1, None, None])
        beyond = np.maximum(far - (streaks.core_px / 2).astype(np.float32)[:, None, None], 0)
        distance = np.maximum(distance - far * far, 0) + beyond * beyond
    return x, y, np.sqrt(distance, out=distance)


def _own_side(centre: np.ndarray, others: np.ndarray, x: np.ndarray, y: np.ndarray, reach: int) -> np.ndarray:
    """Return (k, s, s) pixels nearer to each centre than to any other marker, as far as they are within reach."""
    mine = np.ones(np.broadcast_shapes(x.shape, y.shape), bool)
    between = (others[None] - centre[:, None]).astype(np.float32)  # (k, o, 2)
    gap = np.sqrt((between**2).sum(axis=2))
    for index, other in np.argwhere((gap > 3.0) & (gap < 2 * reach)).tolist():
        ahead, far = between[index, other], gap[index, other]
        mine[index] &= x[index] * ahead[0] + y[index] * ahead[1] < 0.5 * far * far - far / 20
    return mine


def _levels(patch: np.ndarray, ring: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (k,) the darkest quarter of each patch over its ring, and the level that most of it does not pass."""
    values = np.where(ring, patch, np.nan)
    values = np.sort(values.reshape(len(patch), -1), axis=1)  # nan last
    count = np.maximum(ring.reshape(len(patch), -1).sum(axis=1), 1)
    dark, bright = (np.nan_to_num(values[np.arange(len(patch)), (share * count).astype(int)]) for share in _PARTS)
    return dark, bright
