"""Markers too faint for the spots: CSRT follows each of them all along, in a crop that moves with it."""

import numpy as np

from tracking.tracker.csrt import CROP, CropTracker
from tracking.tracker.windows import window

_NEAR = CROP // 2  # pixels from the middle of its crop beyond which a marker gets a new one


class FaintMarkers:
    """CSRT on some markers, each for itself; what it says is checked by nobody but the distances to neighbours.

    Args:
        luma: (h, w) uint8, the frame of the boxes.
        position_px: (m, 2) of all markers.
        diameter_px: (m,).
        which: (m,) bool, the faint ones.
    """

    def __init__(self, luma: np.ndarray, position_px: np.ndarray, diameter_px: np.ndarray, which: np.ndarray) -> None:
        self.which = which
        self._diameter_px = diameter_px
        self._crops: dict[int, tuple[CropTracker, np.ndarray]] = {}
        for marker in np.flatnonzero(which).tolist():
            self._start(luma, marker, position_px[marker])

    def step(self, luma: np.ndarray) -> dict[int, np.ndarray]:
        """Where CSRT sees each of them in the next frame."""
        found: dict[int, np.ndarray] = {}
        for marker, (tracker, corner) in list(self._crops.items()):
            column, row = (corner + CROP).tolist()
            place = tracker.update(window(luma, column, row, CROP)) + corner
            if not np.isfinite(place).all():
                continue
            found[marker] = place
            if np.abs(place - corner - CROP).max() > _NEAR:
                self._start(luma, marker, place)
        return found

    def _start(self, luma: np.ndarray, marker: int, place: np.ndarray) -> None:
        column, row = np.rint(place).astype(int).tolist()
        corner = np.array([column - CROP, row - CROP])
        crop = window(luma, column, row, CROP)
        self._crops[marker] = (CropTracker(crop, place - corner, float(self._diameter_px[marker])), corner)
