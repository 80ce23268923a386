"""The baseline without a model: threshold the picture around each marker and take the nearest piece."""

import cv2
import numpy as np

from tracking.tracker import Sighting

_REACH_PX = 40


class NearestSpot:
    """Threshold-and-nearest on m markers, with no prediction and no joint assignment.

    Args:
        luma: (h, w) uint8, the frame of the boxes.
        centre_px: (m, 2) centres of the boxes.
    """

    def __init__(self, luma: np.ndarray, centre_px: np.ndarray) -> None:
        self._place = centre_px.astype(float)
        height, width = luma.shape
        column, row = np.clip(np.rint(centre_px).astype(int).T, 0, [[width - 1], [height - 1]])
        self._dark = float(np.median(luma[row, column])) < float(np.median(luma))
        self.first = self.step(luma)

    def step(self, luma: np.ndarray) -> Sighting:
        """Takes the next frame (h, w) uint8."""
        found = np.array([self._nearest(luma, place) for place in self._place])
        seen = np.isfinite(found).all(axis=1)
        self._place = np.where(seen[:, None], found, self._place)
        unknown = np.full(len(seen), np.nan)
        return Sighting(self._place, seen, seen.astype(float), unknown, unknown, np.zeros_like(seen))

    def _nearest(self, luma: np.ndarray, place: np.ndarray) -> np.ndarray:
        left, top = np.maximum(np.rint(place).astype(int) - _REACH_PX, 0).tolist()
        patch = np.ascontiguousarray(luma[top : top + 2 * _REACH_PX + 1, left : left + 2 * _REACH_PX + 1])
        if patch.size == 0:
            return np.full(2, np.nan)
        kind = cv2.THRESH_BINARY_INV if self._dark else cv2.THRESH_BINARY
        _, pieces = cv2.threshold(patch, 0, 255, kind | cv2.THRESH_OTSU)
        _, _, stats, centres = cv2.connectedComponentsWithStats(pieces)
        good = stats[1:, cv2.CC_STAT_AREA] >= 12
        if not good.any():
            return np.full(2, np.nan)
        candidates = centres[1:][good] + [left, top]
        return candidates[np.argmin(np.linalg.norm(candidates - place, axis=1))]
