"""Colours of the markers, where they differ: a spot in the colour of another marker is not one's own."""

from dataclasses import dataclass

import numpy as np

_APART = 30.0  # levels of the colour differences by which two markers are told apart; compression shifts them by 10
_MIDDLE = 0.25  # share of a diameter about its centre in which a marker shows its own colour
_SURELY = 0.5  # of the way on from half-way to another colour, from which on a spot surely is that other's


@dataclass(frozen=True, eq=False)
class MarkerColours:
    """Colours of m markers of which some differ clearly."""

    own: np.ndarray  # (m, 2) colour differences (U, V) in the frame of the boxes, levels of 1/255

    @classmethod
    def of_markers(
        cls, yuv: np.ndarray | None, position_px: np.ndarray, diameter_px: np.ndarray
    ) -> "MarkerColours | None":
        """Measure the colours of markers at (m, 2) in a picture (h, w, 3); None where all are of about one colour."""
        if yuv is None or len(position_px) < 2:
            return None
        colours = cls(_seen(yuv, position_px, diameter_px))
        return colours if (colours._apart >= _APART).any() else None

    @property
    def _apart(self) -> np.ndarray:
        """(m, m) how far the colours are apart, levels."""
        apart: np.ndarray = np.linalg.norm(self.own[:, None] - self.own[None], axis=2)
        return apart

    def unlike(self, yuv: np.ndarray, position_px: np.ndarray, diameter_px: np.ndarray) -> np.ndarray:
        """Return (m, c) how much each of c places (c, 2) looks like another marker instead of each marker.

        It is 0 up to half-way between their colours and 1 in the colour of the other; 0 too between markers of like
        colours. The picture is (h, w, 3) brightness and colour differences, the markers have (m,) diameters.
        """
        colour = _seen(yuv, position_px, np.broadcast_to(np.median(diameter_px), len(position_px)))
        away = np.linalg.norm(self.own[:, None] - colour[None], axis=2)  # (m, c)
        apart = self._apart
        nearer = away[:, None] - away[None]  # (m, k, c): how much nearer to k than to m
        share = np.where(apart[..., None] >= _APART, nearer / np.maximum(apart, _APART)[..., None], 0.0)
        most = share.max(axis=1, initial=0.0)
        return np.clip(most / _SURELY, 0, 1)


def _seen(yuv: np.ndarray, position_px: np.ndarray, diameter_px: np.ndarray) -> np.ndarray:
    """Return (c, 2) the median colour differences about places (c, 2), in a square of half a diameter."""
    height, width = yuv.shape[:2]
    middle = np.rint(position_px).astype(int)
    found = np.empty((len(middle), 2))
    for number, ((column, row), reach) in enumerate(
        zip(middle.tolist(), np.maximum(np.rint(_MIDDLE * diameter_px), 1).astype(int).tolist(), strict=True)
    ):
        left, top = np.clip([column - reach, row - reach], 0, [width - 1, height - 1])
        part = yuv[top : max(row + reach, 0) + 1, left : max(column + reach, 0) + 1, 1:]
        found[number] = np.median(part.reshape(-1, 2), axis=0)
    return found
