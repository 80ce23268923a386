"""Camera that looks straight down on the pool: perspective, lens and rolling shutter."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from swimcal.robot import NonNegative, Positive
from swimcal.session_file import Distortion
from swimcal.toml import TomlTable

PX_PER_M = 965.0  # scale on the water, in the published videos at 3840 x 2160
_NOMINAL_HEIGHT_M = 2.3  # It gives the focal length where the height is left open.


class Optics(TomlTable):
    """A pinhole camera with OpenCV's lens distortion, above the origin of the pool and looking down.

    The pool's frame: x to the right of the image, y up in the image, z up from the water, m. What is below the
    water is seen along straight rays: only the robot's body is, and no marker.
    """

    # width_px, height_px: size of the picture; multiples of 2 and 4
    width_px: Annotated[int, Field(ge=32, multiple_of=2)] = 1280
    height_px: Annotated[int, Field(ge=32, multiple_of=4)] = 720
    fps: Positive = 60.0  # frames a second
    px_per_m: Positive = PX_PER_M  # scale on the water
    # height of the camera above the water; None for no parallax: everything is seen as if it lay on the water
    height_m: Positive | None = 2.3
    distortion: Distortion = (0.0, 0.0, 0.0, 0.0, 0.0)  # k1, k2, p1, p2, k3 of OpenCV
    readout_s: NonNegative = 0.0  # time of the rolling shutter from the first row to the last; 0 for a global one
    exposure_s: NonNegative = 1 / 240  # exposure of each row
    blur_px: Annotated[float, Field(ge=0.5, le=5)] = 0.8  # standard deviation of the lens' blur
    noise: NonNegative = 2.0  # standard deviation of the sensor's noise, gray levels

    @property
    def focal_px(self) -> float:
        """Focal length."""
        return self.px_per_m * (self.height_m or _NOMINAL_HEIGHT_M)

    def project(self, point_m: np.ndarray) -> np.ndarray:
        """Project (..., 3) points of the pool to (..., 2) px, where the lens shows them.

        OpenCV, "Camera calibration and 3D reconstruction": x'' = x' (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x' y'
        + p2 (r^2 + 2 x'^2), and y'' likewise; u = fx x'' + cx.
        """
        depth_m = self.focal_px / self.px_per_m - (0.0 if self.height_m is None else point_m[..., 2])
        x, y = point_m[..., 0] / depth_m, -point_m[..., 1] / depth_m
        k1, k2, p1, p2, k3 = self.distortion
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
        v = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
        return np.stack(
            [self.focal_px * u + (self.width_px - 1) / 2, self.focal_px * v + (self.height_px - 1) / 2], axis=-1
        )

    def delay_s(self, row_px: np.ndarray) -> np.ndarray:
        """Return how much later than the middle row a row is exposed, s; any shape."""
        return self.readout_s * (row_px / (self.height_px - 1) - 0.5)

    def scale_at(self, height_m: np.ndarray) -> np.ndarray:
        """Return px a metre at heights above the water (any shape, m), next to the middle of the image."""
        if self.height_m is None:
            return np.full(np.shape(height_m), self.px_per_m)
        return self.focal_px / (self.height_m - np.asarray(height_m))
