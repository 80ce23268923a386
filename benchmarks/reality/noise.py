"""Errors that tracking adds to the true pixels: boxes placed by hand, errors that last, a grid of half pixels."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class PixelNoise:
    """Errors of tracked boxes, independent between markers and axes."""

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
