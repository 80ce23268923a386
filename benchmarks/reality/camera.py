"""Pinhole camera above the pool: places in metres become pixels, x to the right and y down; and errors of tracking."""

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


@dataclass(frozen=True)
class PixelNoise:
    """Errors that tracking adds to the true pixels: boxes placed by hand, errors that last, a grid of half pixels.

    They are independent between markers and axes.
    """

    sd_px: float = 0.5  # standard deviation of the error that wanders with time
    correlation_s: float = 0.1  # time in which the correlation of that falls to 1/e; 0: white
    placement_sd_px: float = 2.0  # standard deviation of a box's offset from its marker, constant in a trial
    grid_px: float = 0.5  # positions are multiples of it; 0: any

    def tracked(self, time_s: np.ndarray, position_px: np.ndarray, random: np.random.Generator) -> np.ndarray:
        """Return (f, m, 2) pixels that a tracker gives for true ones (f, m, 2) at times (f,) of one trial.

        The error is an Ornstein-Uhlenbeck process, exact between frames: e_k = a e_(k-1) + sd sqrt(1 - a^2) z_k with
        a = exp(-dt / correlation), begun in its stationary distribution.
        """
        offset = self.placement_sd_px * random.standard_normal(position_px.shape[1:])
        return self._add_errors(time_s, position_px + offset, random.standard_normal(position_px.shape))

    def _add_errors(self, time_s: np.ndarray, placed_px: np.ndarray, error: np.ndarray) -> np.ndarray:
        """Return (f, m, 2) px of boxes as they were placed, with errors (f, m, 2) of sd 1 that are made to last."""
        kept = np.exp(-np.diff(time_s) / self.correlation_s) if self.correlation_s > 0 else np.zeros(len(time_s) - 1)
        for k, a in enumerate(kept, start=1):
            error[k] = a * error[k - 1] + np.sqrt(1 - a**2) * error[k]
        seen = placed_px + self.sd_px * error
        return np.round(seen / self.grid_px) * self.grid_px if self.grid_px > 0 else seen
