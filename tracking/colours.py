"""Hues of the markers, where they differ: they keep names apart, and find a lost robot anywhere in the picture.

A marker's chroma is its difference of colour from gray, U + iV; the direction of that is its hue. Shade changes the
length, not the direction.
"""

from dataclasses import dataclass

import numpy as np

from tracking.appearance import Appearance
from tracking.identities import FAINTER, MISSED, OTHER_HUE, share_out
from tracking.spots import find_spots

_COLOURED, _HINT = 25.0, 15.0  # levels of chroma of a marker that has a hue, and of a spot that shows one
_APART_RAD = np.deg2rad(40)  # angle between hues that are told apart: light and compression shift them
_OWN_HUES = 3  # markers with a hue of their own, from which on a gray one surely is gray, and not under a glint
_MIDDLE = 0.25  # share of a diameter about its centre in which a marker shows its own colour
_SURELY = 0.5  # share of the way from half-way to another hue, from which on a spot surely has the other's

# The redetection of a lost robot.
_LIKELY = 0.5  # strength from which a spot may be a marker that was lost
_STRETCHES = 0.2  # share of a distance by which it usually changes: the body bends, and the camera moves
_MOST = 4.0  # the most that one distance can cost
_SURE = 1.5  # cost by which any other choice must be worse


@dataclass(frozen=True, eq=False)
class MarkerColours:
    """Colours of m markers of which some clearly differ in hue. One under a glint has none, nor white and black ones.

    Attributes:
        chroma: (m,) complex, levels of 1/255, in the frame of the boxes.
    """

    chroma: np.ndarray

    @classmethod
    def of_markers(
        cls, yuv: np.ndarray | None, position_px: np.ndarray, diameter_px: np.ndarray
    ) -> "MarkerColours | None":
        """Measure the colours of markers at (m, 2) in a picture (h, w, 3); None where all are of about one hue."""
        if yuv is None or len(position_px) < 2:
            return None
        colours = cls(chroma_at(yuv, position_px, diameter_px))
        return colours if colours._told_apart.any() else None

    @property
    def _hued(self) -> np.ndarray:
        """(m,) bool, the markers that have a hue."""
        hued: np.ndarray = np.abs(self.chroma) >= _COLOURED
        return hued

    @property
    def _told_apart(self) -> np.ndarray:
        """(m, m) bool, the pairs of markers whose hues differ clearly."""
        return self._hued[:, None] & self._hued & (_angles(self.chroma, self.chroma) >= _APART_RAD)

    def mismatch(self, chroma: np.ndarray) -> np.ndarray:
        """Return (m, c) how much each of c places, by their chroma (c,), looks like another marker than each marker.

        It is 0 up to half-way between their hues and 1 in the hue of the other; 0 too for gray places, and between
        markers of like hues. For a gray marker it is 1 in a hue that only one of several markers has.
        """
        away, apart = _angles(self.chroma, chroma), _angles(self.chroma, self.chroma)
        nearer = away[:, None] - away[None]  # (m, k, c): how much nearer to k than to m
        told = self._told_apart[..., None] & (np.abs(chroma) >= _HINT)
        share = np.where(told, nearer / np.maximum(apart, _APART_RAD)[..., None], 0.0)
        by_hue = np.clip(share.max(axis=1, initial=0.0) / _SURELY, 0, 1)
        unique = self._hued & (self._told_apart.sum(axis=1) == np.count_nonzero(self._hued) - 1)
        if np.count_nonzero(unique) < _OWN_HUES:
            return by_hue
        of_one = ((away < _APART_RAD / 2) & unique[:, None] & (np.abs(chroma) >= _COLOURED)).any(axis=0)
        return np.maximum(by_hue, ~self._hued[:, None] & of_one)

    def matches(self, chroma: np.ndarray) -> np.ndarray:
        """Return (m, c) bool, the places, by their chroma (c,), in the hue of each marker; gray ones match gray."""
        alike = (_angles(self.chroma, chroma) < _APART_RAD) & (np.abs(chroma) >= _HINT)
        return np.where(self._hued[:, None], alike, np.abs(chroma) < _COLOURED)


def chroma_at(yuv: np.ndarray, position_px: np.ndarray, diameter_px: np.ndarray) -> np.ndarray:
    """Measure the chroma (c,), complex, at places (c, 2) of a picture: the median over a square of half a diameter.

    Args:
        yuv: (h, w, 3) uint8, brightness and colour differences.
        position_px: (c, 2) places; of those beyond the picture the colour at its rim.
        diameter_px: (c,) or (1,) diameters of the markers.
    """
    height, width = yuv.shape[:2]
    middle = np.rint(position_px).astype(int)
    reach = np.maximum(np.rint(_MIDDLE * np.broadcast_to(diameter_px, len(middle))), 1).astype(int)
    found = np.empty((len(middle), 2))
    for number, ((column, row), half) in enumerate(zip(middle.tolist(), reach.tolist(), strict=True)):
        left, top = np.clip([column - half, row - half], 0, [width - 1, height - 1])
        part = yuv[top : max(row + half, 0) + 1, left : max(column + half, 0) + 1, 1:]
        found[number] = np.median(part.reshape(-1, 2), axis=0)
    return (found - 128.0) @ np.array([1, 1j])


def redetect(
    grey: np.ndarray,
    yuv: np.ndarray,
    colours: MarkerColours,
    look: Appearance,
    pairs: np.ndarray,
    apart_px: np.ndarray,
) -> np.ndarray | None:
    """Find the places (m, 2), px, of all markers in a picture, wherever they are; None where these are not certain.

    They are certain where each marker has a spot in its hue, and any other choice of spots is clearly worse.

    Args:
        grey: (h, w) uint8, in which the markers are sought.
        yuv: (h, w, 3) uint8 brightness and colour differences.
        colours: of the m markers.
        look: of the markers in `grey`.
        pairs: (m - 1, 2) which markers are joined to a tree.
        apart_px: (m - 1,) distances of these at the start.
    """
    places = _all_spots(grey, look)
    if len(places) < len(look.sign):
        return None
    chroma = chroma_at(yuv, places, np.median(look.diameter_px, keepdims=True))
    alone = OTHER_HUE * np.maximum(colours.mismatch(chroma), ~colours.matches(chroma))
    alone = np.hstack([alone, np.full((len(alone), 1), MISSED + FAINTER)])
    between = np.linalg.norm(places[:, None] - places[None], axis=2)
    off = (between[None] - apart_px[:, None, None]) / (_STRETCHES * apart_px[:, None, None])
    links = np.zeros((len(pairs), len(places) + 1, len(places) + 1))
    links[:, :-1, :-1] = np.minimum(off**2, _MOST)
    cost, chosen = share_out(alone, links, pairs)
    if (chosen < 0).any():
        return None
    for marker, spot in enumerate(chosen.tolist()):
        other = alone.copy()
        other[marker, spot] = np.inf
        if share_out(other, links, pairs)[0] < cost + _SURE:
            return None
    return places[chosen]


def _all_spots(grey: np.ndarray, look: Appearance) -> np.ndarray:
    """Return (c, 2) px, the places in a picture (h, w) that look like one of the markers, each once."""
    height, width = grey.shape
    middle, reach = np.array([[width / 2, height / 2]]), np.array([max(width, height) / 2])
    places = np.empty((0, 2))
    for marker in range(len(look.sign)):
        spots = find_spots(grey, middle, reach, look.of(np.array([marker])))
        found = spots.position_px[spots.strength >= _LIKELY]
        away = np.linalg.norm(found[:, None] - places[None], axis=2).min(axis=1, initial=np.inf)
        places = np.vstack([places, found[away > look.diameter_px[marker] / 2]])
    return places


def _angles(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return (k, l) angles, rad, between complex (k,) and (l,)."""
    angles: np.ndarray = np.abs(np.angle(one[:, None] * other.conj()))
    return angles
