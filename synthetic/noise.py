"""The errors that a tracker adds to the place of a marker: lasting errors, boxes placed by hand, a half-pixel grid."""

from typing import Annotated

import numpy as np
from pydantic import Field
from scipy.signal import lfilter

from session.toml_source import Table
from swimmer.robot import NonNegative, Positive


class TrackingNoise(Table):
    """Errors of tracked boxes, the same in x and y, and what neighbours along the body have of them in common.

    The defaults are those we measured on the published tracks: boxes of whole pixels, hence centres on a half-pixel
    grid, and residuals that stay correlated over 3 to 17 frames at 60 frames a second.

    Attributes:
        sd_px: standard deviation of the error that changes with time, before rounding to the grid.
        correlation_s: time in which its correlation falls to 1/e; 0 for white noise.
        shared: share of the variance of these errors that is common to markers in one place; the rest is each marker's
            own. The placement of boxes and the rounding are never shared.
        shared_length_m: distance along the body over which the correlation of the common share falls to 1/e.
        placement_sd_px: standard deviation of the offset between a box and its marker, constant over a trial.
        half_pixel_grid: whether positions are rounded to halves of a pixel.
    """

    sd_px: NonNegative = 0.5
    correlation_s: NonNegative = 0.1
    placement_sd_px: NonNegative = 2.0
    half_pixel_grid: bool = True
    shared: Annotated[float, Field(ge=0, le=1)] = 0.0
    shared_length_m: Positive = 0.2

    def across(self, place_m: np.ndarray) -> np.ndarray:
        """Compute the (m, m) correlation between the lasting errors of markers at places (m,) along the body, m."""
        apart_m = np.abs(place_m[:, None] - place_m)
        return (1.0 - self.shared) * np.eye(len(place_m)) + self.shared * np.exp(-apart_m / self.shared_length_m)


NOISELESS = TrackingNoise(sd_px=0.0, correlation_s=0.0, placement_sd_px=0.0, half_pixel_grid=False)


def lasting_errors(
    shape: tuple[int, ...],
    step_s: float,
    noise: TrackingNoise,
    random: np.random.Generator,
    place_m: np.ndarray | None = None,
) -> np.ndarray:
    """Draw stationary errors with exponentially falling autocorrelation, px.

    The exact discretisation of the Ornstein-Uhlenbeck process: AR(1) with coefficient exp(-step / correlation), begun
    in the stationary distribution (Gillespie 1996, Exact numerical simulation of the Ornstein-Uhlenbeck process and its
    integral, Phys. Rev. E 54, 2084).

    Args:
        shape: (n, ...) for n frames of series; (n, m, ...) for markers that have errors in common.
        step_s: time between frames.
        noise: its `sd_px`, `correlation_s` and, with places, `shared` are used.
        random: draws the errors.
        place_m: (m,) places of the markers along the body; without them all series are independent.
    """
    carried = np.exp(-step_s / noise.correlation_s) if noise.correlation_s > 0 else 0.0
    fresh = noise.sd_px * random.standard_normal(shape)
    if place_m is not None and noise.shared > 0:
        fresh = np.einsum("ab,nb...->na...", np.linalg.cholesky(noise.across(place_m)), fresh)
    fresh[1:] *= np.sqrt(1.0 - carried**2)
    return lfilter([1.0], [1.0, -carried], fresh, axis=0)


def placement_offsets(markers: int, noise: TrackingNoise, random: np.random.Generator) -> np.ndarray:
    """Draw the (m, 2) offsets of the boxes of a trial from their markers, px."""
    return noise.placement_sd_px * random.standard_normal((markers, 2))


def on_grid(position_px: np.ndarray, noise: TrackingNoise) -> np.ndarray:
    """Round positions of any shape to the grid of the tracker, px; unchanged where it has none."""
    return np.round(2.0 * position_px) / 2.0 if noise.half_pixel_grid else position_px
