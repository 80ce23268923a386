"""A camera that looks straight down on the pool: perspective, lens and rolling shutter."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from session.camera import CameraCalibration, Distortion

PX_PER_M = 965.0  # on the water, in the published videos at 3840 x 2160
_NOMINAL_HEIGHT_M = 2.3  # gives the focal length where the height is left open


@dataclass(frozen=True)
class PoolCamera:
    """A pinhole camera with OpenCV's lens distortion, above the origin of the pool and looking down.

    The pool's frame: x to the right of the image, y up in the image, z up from the water, m. Without
    `lens.height_above_water_m` everything is seen as if it lay on the water, so there is no parallax. What is below the
    water is seen along straight rays: only the robot's body is, and no marker.

    Attributes:
        lens: focal lengths, principal point, distortion and height.
        px_per_m: scale on the water.
        readout_s: time from the exposure of the first row to that of the last; 0 for a global shutter.
    """

    lens: CameraCalibration
    px_per_m: float
    readout_s: float = 0.0

    @classmethod
    def above(
        cls,
        width_px: int,
        height_px: int,
        px_per_m: float = PX_PER_M,
        height_m: float | None = None,
        distortion: Distortion = (0.0, 0.0, 0.0, 0.0, 0.0),
        readout_s: float = 0.0,
    ) -> Self:
        """A camera above the middle of its image.

        Args:
            width_px, height_px: size of the image.
            px_per_m: scale on the water.
            height_m: of the camera above the water; None for no parallax.
            distortion: k1, k2, p1, p2, k3 of OpenCV.
            readout_s: of the rolling shutter.
        """
        focal_px = px_per_m * (height_m or _NOMINAL_HEIGHT_M)
        lens = CameraCalibration(
            width_px=width_px,
            height_px=height_px,
            fx_px=focal_px,
            fy_px=focal_px,
            cx_px=(width_px - 1) / 2,
            cy_px=(height_px - 1) / 2,
            distortion=distortion,
            height_above_water_m=height_m,
        )
        return cls(lens, px_per_m, readout_s)

    def project(self, point_m: np.ndarray) -> np.ndarray:
        """(..., 3) points of the pool -> (..., 2) px, where the lens shows them.

        OpenCV, "Camera calibration and 3D reconstruction": x'' = x' (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x' y'
        + p2 (r^2 + 2 x'^2), and y'' alike; u = fx x'' + cx.
        """
        lens = self.lens
        depth_m = lens.fx_px / self.px_per_m - (0.0 if lens.height_above_water_m is None else point_m[..., 2])
        x, y = point_m[..., 0] / depth_m, -point_m[..., 1] / depth_m
        k1, k2, p1, p2, k3 = lens.distortion
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
        v = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
        return np.stack([lens.fx_px * u + lens.cx_px, lens.fy_px * v + lens.cy_px], axis=-1)

    def delay_s(self, row_px: np.ndarray) -> np.ndarray:
        """How much later than the middle row a row is exposed, s; any shape."""
        return self.readout_s * (row_px / (self.lens.height_px - 1) - 0.5)

    def scale_at(self, height_m: np.ndarray) -> np.ndarray:
        """px a metre at heights above the water (any shape, m), next to the middle of the image."""
        if self.lens.height_above_water_m is None:
            return np.full(np.shape(height_m), self.px_per_m)
        return self.lens.fx_px / (self.lens.height_above_water_m - np.asarray(height_m))
