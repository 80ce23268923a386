"""CSRT, OpenCV's correlation tracker, in a crop around a marker.

Lukežič et al., "Discriminative Correlation Filter with Channel and Spatial Reliability", CVPR 2017. Its boxes hold
whole pixels and it reports neither how sure it is nor when it has lost its marker. `tracking.tracker.second_opinion`
asks it where no spot answers, and checks its answer; `tracking.tracker.faint` follows with it what no spot ever
answers for. With every update it converts the whole image, so a crop costs half.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

import cv2
import numpy as np

from tracking.tracker.windows import window

CROP = 80  # half the side of the crop, pixels
_FASTEST_PX = CROP // 4  # by which a crop that moves does so in a frame at most


class Crop(NamedTuple):
    """A marker in its surroundings."""

    picture: np.ndarray  # (s, s) uint8
    corner: np.ndarray  # (2,) int, where in the whole picture it begins
    place_px: np.ndarray  # (2,) of the marker in the whole picture

    @classmethod
    def around(cls, luma: np.ndarray, place_px: np.ndarray) -> "Crop":
        """That of a marker in a picture (h, w)."""
        column, row = np.rint(place_px).astype(int).tolist()
        return cls(window(luma, column, row, CROP).copy(), np.array([column, row]) - CROP, place_px)


class CropTracker:
    """CSRT on one marker, in a box of `side_px` whole pixels, within a crop that moves with the marker or does not."""

    def __init__(self, start: Crop, side_px: int, moves: bool = False) -> None:
        centre = start.place_px - start.corner
        corner = np.rint(centre - (side_px - 1) / 2).astype(int)
        self._offset = centre - (corner + (side_px - 1) / 2)
        self._corner, self._moves = start.corner, moves
        self._tracker = cv2.TrackerCSRT.create()
        self._tracker.init(_colour(start.picture), (*corner.tolist(), side_px, side_px))

    def step(self, luma: np.ndarray) -> np.ndarray:
        """(2,) where it believes the marker to be in the next picture (h, w); nan when it gives up."""
        column, row = (self._corner + CROP).tolist()
        found, (x, y, width, height) = self._tracker.update(_colour(window(luma, column, row, CROP)))
        if not found:
            return np.full(2, np.nan)
        place = np.array([x + (width - 1) / 2, y + (height - 1) / 2]) + self._offset + self._corner
        if self._moves:
            ahead = np.clip(np.rint(place - self._corner - CROP).astype(int), -_FASTEST_PX, _FASTEST_PX)
            self._corner = np.clip(self._corner + ahead, -CROP, np.array(luma.shape[::-1]) - 1 - CROP)
        return place


@contextmanager
def opencv_on_one_thread() -> Iterator[None]:
    """OpenCV uses no threads of its own within, which would double those on which trackers run side by side.

    The setting is the whole process's, and is put back afterwards.
    """
    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(before)


def _colour(picture: np.ndarray) -> np.ndarray:
    return cv2.cvtColor(np.ascontiguousarray(picture), cv2.COLOR_GRAY2BGR)
