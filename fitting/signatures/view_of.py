"""Where the camera stood over a swim, in the frame in which the twin swims it."""

import numpy as np

from fitting.trial import MeasuredTrial
from session import CameraSpec
from swimmer import RobotSpec
from swimmer.effects import View


def view_of(trial: MeasuredTrial, robot: RobotSpec, camera: CameraSpec) -> View:
    """The view of a trial; without a calibrated lens the picture's middle is that of the place that was swum in.

    Args:
        trial: as measured.
        robot: whose nose and neck were filmed.
        camera: that filmed it.
    """
    first = int(np.flatnonzero(np.isfinite(trial.head.heading_rad))[0])
    cos, sin = np.cos(trial.head.heading_rad[first]), np.sin(trial.head.heading_rad[first])
    to_pool = np.array([[cos, -sin], [sin, cos]])  # from the twin's frame
    nose_m = robot.marker_positions_m(("nose",))[0, :2]
    origin_m = trial.position_m[first, trial.markers.index("nose")] - to_pool @ nose_m
    middle_m, half_height_m = _picture(trial, camera)
    return View(
        axis_m=(middle_m - origin_m) @ to_pool,
        down=np.array([0.0, -1.0]) @ to_pool,
        half_height_m=half_height_m,
    )


def _picture(trial: MeasuredTrial, camera: CameraSpec) -> tuple[np.ndarray, float]:
    """The middle (2,) of the picture in the pool, and from there to its lower edge, m."""
    if (lens := camera.calibration) is not None:
        scale = trial.metres_per_px
        return np.array([lens.cx_px, -lens.cy_px]) * scale, lens.height_px / 2 * scale
    low, high = np.nanmin(trial.position_m, axis=(0, 1)), np.nanmax(trial.position_m, axis=(0, 1))
    return (low + high) / 2, float((high - low).max()) / 2
