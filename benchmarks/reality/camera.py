"""Pinhole camera above the pool: places in metres become pixels, x to the right and y down."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Camera:
    """A pinhole camera whose foot is the pool's origin, the pool's x to the right and its y up in the picture."""

    height_m: float = 2.5  # height of the lens above the plane of the picture's scale
    focal_px: float = 2700.0
    # width_px, height_px: size of the picture; the principal point is its centre
    width_px: int = 3840
    height_px: int = 2160

    @property
    def centre_px(self) -> np.ndarray:
        """(2,) the principal point, the centre of the top left pixel at (0, 0)."""
        return (np.array([self.width_px, self.height_px]) - 1) / 2

    def project(self, place_m: np.ndarray, height_m: np.ndarray) -> np.ndarray:
        """Return (..., 2) px of pool places (...), complex, m, at heights (...) above the plane of the scale, m."""
        below = self.height_m - height_m
        return self.centre_px + self.focal_px * np.stack([place_m.real / below, -place_m.imag / below], axis=-1)


@dataclass(frozen=True, eq=False)
class Sight:
    """One simulation at the moments its frames were exposed (f frames, m markers)."""

    names: tuple[str, ...]  # names of the markers
    time_s: np.ndarray  # (f,) times, s
    marker_m: np.ndarray  # (f, m) places in the pool, complex, m
    axis: np.ndarray  # (f, m) unit vectors along the links that carry the markers, complex
    height_m: np.ndarray  # (f, m) height above the plane of the scale


@dataclass(frozen=True, eq=False)
class Picture:
    """Picture that a camera made of a sight, before any error of a tracker."""

    names: tuple[str, ...]  # names of the markers
    time_s: np.ndarray  # (f,) time stamps of the frames, s
    position_px: np.ndarray  # (f, m, 2) x to the right and y down
    camera: Camera  # camera that looked
