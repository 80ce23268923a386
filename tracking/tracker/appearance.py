"""How the markers look in this video: bright or dark, how wide, how much they stand out."""

from dataclasses import dataclass, replace

import numpy as np

from tracking.tracker.windows import windows

_KEEP = 0.98  # of what is known of a marker's look, frame by frame
_BOUNDS = (0.6, 1.6)  # how far the look may wander from that in the start boxes
_SURROUND = (1.5, 2.2)  # of the box' half side: the ring that counts as background
_SMALLEST_PX = 4.0


@dataclass(frozen=True, eq=False)
class Appearance:
    """The look of m markers.

    Attributes:
        sign: (m,) +1 for a marker brighter than what surrounds it, -1 for a darker one.
        diameter_px: (m,) of a disc of the same area.
        contrast: (m,) how far its luma stands out, in steps of 1/255.
    """

    sign: np.ndarray
    diameter_px: np.ndarray
    contrast: np.ndarray

    def as_array(self) -> np.ndarray:
        """(3, m): sign, diameter and contrast."""
        return np.stack([self.sign, self.diameter_px, self.contrast])

    def of(self, which: np.ndarray) -> "Appearance":
        """The look of some of the markers, by (m,) bool or by number."""
        return Appearance(self.sign[which], self.diameter_px[which], self.contrast[which])

    def seen(
        self, where: np.ndarray, diameter_px: np.ndarray, contrast: np.ndarray, start: "Appearance"
    ) -> "Appearance":
        """The look after one more frame: light and distance change slowly, and only so far from the start.

        Args:
            where: (m,) bool, which markers were seen well.
            diameter_px, contrast: (m,) what was seen.
            start: the look in the start boxes.
        """

        def moved(old: np.ndarray, new: np.ndarray, first: np.ndarray) -> np.ndarray:
            mixed = np.where(where, _KEEP * old + (1 - _KEEP) * new, old)
            return np.clip(mixed, _BOUNDS[0] * first, _BOUNDS[1] * first)

        return replace(
            self,
            diameter_px=moved(self.diameter_px, diameter_px, start.diameter_px),
            contrast=moved(self.contrast, contrast, start.contrast),
        )


def measure_appearance(luma: np.ndarray, centre_px: np.ndarray, box_px: np.ndarray) -> Appearance:
    """Measures the look of markers in the frame of their start boxes.

    Whether a marker is bright or dark is told by the middle of its box against a ring around the box; its area by
    how much light the box holds over that ring.

    Args:
        luma: (h, w) uint8.
        centre_px: (m, 2) centres of the boxes.
        box_px: (m,) mean side of each box.
    """
    rows = [_look(luma, centre, side) for centre, side in zip(centre_px, box_px, strict=True)]
    sign, diameter, contrast = np.array(rows).T
    return Appearance(sign, diameter, contrast)


def _look(luma: np.ndarray, centre_px: np.ndarray, side_px: float) -> tuple[float, float, float]:
    half = max(side_px / 2, _SMALLEST_PX / 2)
    patch, middle = windows(luma, centre_px[None], int(np.ceil(_SURROUND[1] * half)))
    away = np.arange(patch.shape[1]) - patch.shape[1] // 2
    offset = centre_px - middle[0]
    distance = np.hypot(away[None, :] - offset[0], away[:, None] - offset[1])
    ring = patch[0][(distance > _SURROUND[0] * half) & (distance < _SURROUND[1] * half)]
    background = np.median(ring)
    core = np.median(patch[0][distance < 0.3 * half + 1])
    sign = 1.0 if core >= background else -1.0
    light = sign * (patch[0] - background)
    contrast = max(float(np.percentile(light[distance < half], 90)), 1.0)
    area = float(np.clip(light[distance < 1.2 * half] / contrast, 0, 1).sum())
    return sign, max(2 * np.sqrt(area / np.pi), _SMALLEST_PX), contrast
