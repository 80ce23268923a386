"""World whose water holds wakes, and trials as they are made on a real pool."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reality.camera import Camera, PixelNoise
from benchmarks.reality.layout import Layout
from benchmarks.reality.parameters import Parameters
from benchmarks.reality.world import Trial, World, prepared_parameters

NO_STRIPS = (0.0, 0.0, 0.0, 0.0, 0.0)
"""Coefficients of forces by strips, of which there are none."""


@dataclass(frozen=True)
class WakeWorld(World):
    """State that is the same in all trials of a session; see `benchmarks.wake.viscous` for what the numbers do."""

    coefficients: tuple[float, float, float, float, float] = NO_STRIPS
    drag_area_m2: float = 0.01
    cross_drag: float = 1.2
    roughness: float = 1.0  # factor on skin friction
    suction: float = 0.1  # critical leading-edge parameter


@dataclass(frozen=True)
class TrimmedTrial(Trial):
    """A swim whose tail does not rest straight: cables, buoyancy and print differ from one launch to the next."""

    trim_rad: float = 0.0  # bend of each of the robot's hinges at rest

    def trimmed(self, parameters: Parameters, layout: Layout) -> Parameters:
        """Add that bend, shared by the hinges of a gap."""
        rest = parameters.hinge_rest_rad + self.trim_rad / layout.hinges_per_gap
        return replace(parameters, hinge_rest_rad=rest)


def trial_parameters(world: World, trial: Trial, layout: Layout, markers: tuple[str, ...]) -> Parameters:
    """Return one row: the world's robot in the scene of a trial, changed by every mechanism and by the trial's trim."""
    parameters = prepared_parameters(world, trial, layout, markers)
    return trial.trimmed(parameters, layout) if isinstance(trial, TrimmedTrial) else parameters


@dataclass(frozen=True)
class TiltedCamera(Camera):
    """A camera that does not look straight down: turned about its picture's axes, then carried to the same place.

    A lens at height h that looks down along an axis a little off the vertical; the picture's middle still shows the
    pool's origin.
    """

    # about_x_rad, about_y_rad: angles by which the axis leans up and to the right in the picture
    about_x_rad: float = 0.0
    about_y_rad: float = 0.0

    def project(self, place_m: np.ndarray, height_m: np.ndarray) -> np.ndarray:
        """Return (..., 2) pixels, as of `Camera`."""
        x, y, z = place_m.real, place_m.imag, height_m
        up, right = self.about_x_rad, self.about_y_rad
        leaned_y, z = y * np.cos(up) + z * np.sin(up), z * np.cos(up) - y * np.sin(up)
        leaned_x, z = x * np.cos(right) + z * np.sin(right), z * np.cos(right) - x * np.sin(right)
        below = self.height_m - z
        return self.centre_px + self.focal_px * np.stack([leaned_x / below, -leaned_y / below], axis=-1)


@dataclass(frozen=True)
class SharedNoise(PixelNoise):
    """Errors that neighbouring boxes share: the same glare and ripples are in both."""

    shared: float = 0.75  # correlation of the errors of two neighbours

    def tracked(self, time_s: np.ndarray, position_px: np.ndarray, random: np.random.Generator) -> np.ndarray:
        """Return (f, m, 2) pixels that a tracker gives, as of `PixelNoise`; markers are in the order of the body."""
        place = np.arange(position_px.shape[1])
        mixed = np.linalg.cholesky(self.shared ** np.abs(place[:, None] - place))
        error = np.einsum("ij,fjk->fik", mixed, random.standard_normal(position_px.shape))
        offset = self.placement_sd_px * random.standard_normal(position_px.shape[1:])
        return self._add_errors(time_s, position_px + offset, error)
