"""CSRT, OpenCV's correlation tracker, in a fixed crop around a marker.

Lukežič et al., "Discriminative Correlation Filter with Channel and Spatial Reliability", CVPR 2017. Its boxes hold
whole pixels and it neither says how sure it is nor when it has lost its marker: `tracking.tracker.second_opinion` asks
it where no spot answers, and checks what it says. With every update it converts the whole image, so a crop costs half.
"""

import cv2
import numpy as np

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
