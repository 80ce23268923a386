"""How the markers look in this video: bright or dark, how wide, how much they stand out."""

from dataclasses import dataclass, replace

import numpy as np

from tracking.tracker.windows import windows

_KEEP_SIZE, _KEEP_CONTRAST = 0.9, 0.8  # weight that the known look keeps with every frame
_SIZES, _CONTRASTS = (0.4, 3.0), (0.1, 5.0)  # how far the look may wander from that in the start boxes
_SURROUND = (0.85, 1.2)  # of the box' half side: the ring at its rim
_WIDER, _CLEARER = 1.7, 2.0  # sides of a box that may be too small, and times the contrast that then tells
_SMALLEST_PX = 4.0


@dataclass(frozen=True, eq=False)
class Appearance:
    """The look of m markers."""

    sign: np.ndarray  # (m,) +1 for a marker brighter than what surrounds it, -1 for a darker one
    diameter_px: np.ndarray  # (m,) of a disc of the same area
    contrast: np.ndarray  # (m,) how far its luma stands out, in steps of 1/255
    # (m,) how strongly the detector answers to it, in parts of its answer to a disc on a wide plain ground
    answer: np.ndarray

    def as_array(self) -> np.ndarray:
        """(4, m): sign, diameter, contrast and answer."""
        return np.stack([self.sign, self.diameter_px, self.contrast, self.answer])

    def of(self, which: np.ndarray) -> "Appearance":
        """The look of some of the markers, by (m,) bool or by number."""
        return Appearance(self.sign[which], self.diameter_px[which], self.contrast[which], self.answer[which])

    def seen(
        self, surely: np.ndarray, diameter_px: np.ndarray, contrast: np.ndarray, start: "Appearance"
    ) -> "Appearance":
        """The look after one more frame, by (m,) sizes and contrasts of those that are surely themselves (m,).

        Light and distance change slowly, and only so far from the start; both may grow and shrink.
        """
        size = _moved(self.diameter_px, np.where(surely, diameter_px, self.diameter_px), _KEEP_SIZE)
        light = _moved(self.contrast, np.where(surely, contrast, self.contrast), _KEEP_CONTRAST)
        return replace(
            self,
            diameter_px=np.clip(size, _SIZES[0] * start.diameter_px, _SIZES[1] * start.diameter_px),
            contrast=np.clip(light, _CONTRASTS[0] * start.contrast, _CONTRASTS[1] * start.contrast),
        )


def _moved(old: np.ndarray, new: np.ndarray, keep: float) -> np.ndarray:
    return keep * old + (1 - keep) * new


def measure_appearance(luma: np.ndarray, centre_px: np.ndarray, box_px: np.ndarray) -> Appearance:
    """Measures the look of markers in a picture (h, w), in start boxes of (m,) mean sides around (m, 2).

    Whether a marker is bright or dark is found from the middle of its box against the darkest and the brightest quarter
    of a ring at the box' rim, since water and body may both be there; its area by how much light the box holds over
    that quarter. Where a wider ring shows much more contrast, the box is smaller than its marker.
    """
    rows = []
    for centre, side in zip(centre_px, box_px, strict=True):
        tight, wide = _look(luma, centre, side), _look(luma, centre, _WIDER * side)
        rows.append(wide if wide[2] > _CLEARER * tight[2] else tight)
    sign, diameter, contrast = np.array(rows).T
    return Appearance(sign, diameter, contrast, np.ones(len(sign)))


def _look(luma: np.ndarray, centre_px: np.ndarray, side_px: float) -> tuple[float, float, float]:
    half = max(side_px / 2, _SMALLEST_PX / 2)
    patch, middle = windows(luma, centre_px[None], int(np.ceil(_SURROUND[1] * half)))
    away = np.arange(patch.shape[1]) - patch.shape[1] // 2
    offset = centre_px - middle[0]
    distance = np.hypot(away[None, :] - offset[0], away[:, None] - offset[1])
    ring = patch[0][(distance > _SURROUND[0] * half) & (distance < _SURROUND[1] * half)]
    core = np.median(patch[0][distance < 0.3 * half + 1])
    dark, bright = np.percentile(ring, [25, 75])
    sign = 1.0 if core - dark >= bright - core else -1.0
    background = dark if sign > 0 else bright
    light = sign * (patch[0] - background)
    contrast = max(float(np.percentile(light[distance < half], 90)), 1.0)
    area = float(np.clip(light[distance < 1.2 * half] / contrast, 0, 1).sum())
    return sign, max(2 * np.sqrt(area / np.pi), _SMALLEST_PX), contrast
