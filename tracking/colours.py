"""Hues of the markers, where they differ: a spot in the hue of another marker is not one's own."""

from dataclasses import dataclass

import numpy as np

_COLOURED, _HINT = 25.0, 15.0  # levels from gray of a marker that has a hue, and of a spot that shows one
_APART_RAD = np.deg2rad(40)  # angle between hues that are told apart: light and compression shift them
_OWN_HUES = 3  # markers with a hue of their own, from which on a gray one surely is gray, and not under a glint
_MIDDLE = 0.25  # share of a diameter about its centre in which a marker shows its own colour
_SURELY = 0.5  # of the way on from half-way to another hue, from which on a spot surely has that other's


@dataclass(frozen=True, eq=False)
class MarkerColours:
    """Colours of m markers of which some clearly differ in hue.

    Hue is the direction from gray in the plane of colour differences, so shade does not change it. A marker under a
    glint has none, nor have white and black ones.
    """

    own: np.ndarray  # (m,) complex colour differences from gray, U + iV, in the frame of the boxes, levels of 1/255

    @classmethod
    def of_markers(
        cls, yuv: np.ndarray | None, position_px: np.ndarray, diameter_px: np.ndarray
    ) -> "MarkerColours | None":
        """Measure the colours of markers at (m, 2) in a picture (h, w, 3); None where all are of about one hue."""
        if yuv is None or len(position_px) < 2:
            return None
        colours = cls(_seen(yuv, position_px, diameter_px))
        return colours if (colours._apart_rad >= _APART_RAD).any() else None

    @property
    def _apart_rad(self) -> np.ndarray:
        """(m, m) angles between the hues; 0 where one of the two has none."""
        hued = np.abs(self.own) >= _COLOURED
        return np.where(hued[:, None] & hued, _angles(self.own, self.own), 0.0)

    def unlike(self, yuv: np.ndarray, position_px: np.ndarray, diameter_px: np.ndarray) -> np.ndarray:
        """Return (m, c) how much each of c places (c, 2) looks like another marker instead of each marker.

        It is 0 up to half-way between their hues and 1 in the hue of the other; 0 too for gray places, and between
        markers of like hues. For a gray marker it is 1 in a hue that only one of several markers has. The picture is
        (h, w, 3) brightness and colour differences, the markers have (m,) diameters.
        """
        colour = _seen(yuv, position_px, np.broadcast_to(np.median(diameter_px), len(position_px)))
        away, apart = _angles(self.own, colour), self._apart_rad
        nearer = away[:, None] - away[None]  # (m, k, c): how much nearer to k than to m
        told = (apart >= _APART_RAD)[..., None] & (np.abs(colour) >= _HINT)
        share = np.where(told, nearer / np.maximum(apart, _APART_RAD)[..., None], 0.0)
        gray = np.abs(self.own) < _COLOURED
        of_one = ((away < _APART_RAD / 2) & self._unique[:, None] & (np.abs(colour) >= _COLOURED)).any(axis=0)
        return np.maximum(np.clip(share.max(axis=1, initial=0.0) / _SURELY, 0, 1), gray[:, None] & of_one)

    def like(self, yuv: np.ndarray, position_px: np.ndarray, diameter_px: np.ndarray) -> np.ndarray:
        """Return (m, c) bool, the places (c, 2) that have the hue of each marker; as of `unlike`, gray as gray."""
        colour = _seen(yuv, position_px, np.broadcast_to(np.median(diameter_px), len(position_px)))
        hued = np.abs(self.own) >= _COLOURED
        alike = (_angles(self.own, colour) < _APART_RAD) & (np.abs(colour) >= _HINT)
        return np.where(hued[:, None], alike, np.abs(colour) < _COLOURED)

    @property
    def _unique(self) -> np.ndarray:
        """(m,) bool, the markers whose hue no other has, where each has one of its own."""
        hued = np.abs(self.own) >= _COLOURED
        alone = hued & ~((_angles(self.own, self.own) < _APART_RAD) & hued & ~np.eye(len(hued), dtype=bool)).any(axis=1)
        return alone if np.count_nonzero(alone) >= _OWN_HUES else np.zeros(len(hued), bool)


def _angles(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return (k, l) angles, rad, between complex (k,) and (l,)."""
    angles: np.ndarray = np.abs(np.angle(one[:, None] * other.conj()))
    return angles


def _seen(yuv: np.ndarray, position_px: np.ndarray, diameter_px: np.ndarray) -> np.ndarray:
    """Return (c,) complex median colour differences from gray about places (c, 2), in a square of half a diameter."""
    height, width = yuv.shape[:2]
    middle = np.rint(position_px).astype(int)
    found = np.empty((len(middle), 2))
    for number, ((column, row), reach) in enumerate(
        zip(middle.tolist(), np.maximum(np.rint(_MIDDLE * diameter_px), 1).astype(int).tolist(), strict=True)
    ):
        left, top = np.clip([column - reach, row - reach], 0, [width - 1, height - 1])
        part = yuv[top : max(row + reach, 0) + 1, left : max(column + reach, 0) + 1, 1:]
        found[number] = np.median(part.reshape(-1, 2), axis=0)
    return (found - 128.0) @ np.array([1, 1j])
