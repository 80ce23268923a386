"""CSRT, OpenCV's correlation tracker, in a fixed crop around a marker.

Lukežič et al., "Discriminative Correlation Filter with Channel and Spatial Reliability", CVPR 2017. Its boxes hold
whole pixels and it neither says how sure it is nor when it has lost its marker: `tracking.tracker.second_opinion` asks
it where no spot answers, and checks what it says. With every update it converts the whole image, so a crop costs half.
"""

from concurrent.futures import ThreadPoolExecutor

import cv2
import numpy as np

from tracking.tracker.tracker import Sighting

CROP = 80  # half the side of the crop, pixels
_BOX = 1.5  # side of the box, in diameters
_SMALLEST_BOX_PX = 21  # smaller boxes cost double


class CropTracker:
    """CSRT on one marker within one crop.

    Args:
        crop: (s, s) uint8, with the marker in it.
        centre_px: (2,) of the marker within the crop.
        side_px: of the box around it, whole pixels.
    """

    def __init__(self, crop: np.ndarray, centre_px: np.ndarray, side_px: int) -> None:
        corner = np.rint(centre_px - (side_px - 1) / 2).astype(int)
        self._offset = centre_px - (corner + (side_px - 1) / 2)
        self._tracker = cv2.TrackerCSRT.create()
        self._tracker.init(_colour(crop), (*corner.tolist(), side_px, side_px))

    def update(self, crop: np.ndarray) -> np.ndarray:
        """(2,) where it believes the marker to be in the next crop of the same place; nan when it gives up."""
        found, (x, y, width, height) = self._tracker.update(_colour(crop))
        if not found:
            return np.full(2, np.nan)
        return np.array([x + (width - 1) / 2, y + (height - 1) / 2]) + self._offset


def box_side(diameter_px: float) -> int:
    """Side in whole pixels of a box around a marker of that diameter, for one that nobody drew."""
    return max(round(_BOX * diameter_px), _SMALLEST_BOX_PX)


def _colour(crop: np.ndarray) -> np.ndarray:
    return cv2.cvtColor(np.ascontiguousarray(crop), cv2.COLOR_GRAY2BGR)


class PlainCsrt:
    """OpenCV's CSRT on m markers.

    Args:
        luma: (h, w) uint8, the frame of the boxes.
        corner_px: (m, 2) top left corners of the boxes.
        side_px: (m, 2) width and height of each.
        threads: on which the trackers are updated side by side, 0 for all cores.
    """

    def __init__(self, luma: np.ndarray, corner_px: np.ndarray, side_px: np.ndarray, threads: int = 0) -> None:
        self._threads = threads
        picture = cv2.cvtColor(np.ascontiguousarray(luma), cv2.COLOR_GRAY2BGR)
        self._trackers = [cv2.TrackerCSRT.create() for _ in corner_px]
        boxes = np.rint(np.hstack([corner_px, side_px])).astype(int)
        for tracker, box in zip(self._trackers, boxes.tolist(), strict=True):
            tracker.init(picture, tuple(box))
        self.first = self._sighting([(True, box) for box in boxes.tolist()])

    def step(self, luma: np.ndarray, *, frames: float = 1.0) -> Sighting:  # noqa: ARG002  it has no motion model
        """Takes the next frame (h, w) uint8."""
        picture = cv2.cvtColor(np.ascontiguousarray(luma), cv2.COLOR_GRAY2BGR)
        with ThreadPoolExecutor(self._threads or None) as pool:
            return self._sighting(list(pool.map(lambda tracker: tracker.update(picture), self._trackers)))

    @staticmethod
    def _sighting(answers: list[tuple[bool, tuple[int, int, int, int]]]) -> Sighting:
        seen = np.array([found for found, _ in answers])
        box = np.array([box for _, box in answers], float)  # (m, 4)
        unknown = np.full(len(seen), np.nan)
        centre = box[:, :2] + (box[:, 2:] - 1) / 2
        return Sighting(centre, seen, seen.astype(float), unknown, unknown, np.zeros_like(seen))
