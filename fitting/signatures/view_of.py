"""Where the camera stood over a swim, in the frame in which the twin swims it."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from fitting.trial import MeasuredTrial
from session import CameraSpec
from session.camera import CameraCalibration
from swimmer.effects import View

COMMON_PX = (
    (640, 480),
    (1280, 720),
    (1920, 1080),
    (1920, 1440),
    (2704, 1520),
    (2704, 2028),
    (3840, 2160),
    (5312, 2988),
)
"""Sizes of the pictures of common cameras, width and height; the smallest comes first."""
TO_PX = np.array([1.0, -1.0])  # the pool's y points up in the picture


def picture_px(trials: Iterable[MeasuredTrial], camera: CameraSpec) -> tuple[float, float]:
    """Width and height of the picture: as calibrated, else the least common size that holds all that was tracked."""
    if (lens := camera.calibration) is not None:
        return lens.width_px, lens.height_px
    reached = np.max([np.nanmax(TO_PX * each.position_m / each.metres_per_px, axis=(0, 1)) for each in trials], axis=0)
    holding = [size for size in COMMON_PX if (reached < size).all()]
    return holding[0] if holding else (float(reached[0]), float(reached[1]))


def with_picture(camera: CameraSpec, trials: Iterable[MeasuredTrial]) -> CameraSpec:
    """The camera with the picture that all trials of a session tell, so that every part of it is seen in the same one.

    For views alone: its focal length is only a place holder.
    """
    if camera.calibration is not None:
        return camera
    width, height = (round(size) for size in picture_px(trials, camera))
    picture = CameraCalibration(
        width_px=width, height_px=height, fx_px=width, fy_px=width, cx_px=width / 2, cy_px=height / 2
    )
    return replace(camera, calibration=picture)


def view_of(
    trial: MeasuredTrial,
    simulated_m: np.ndarray,
    camera: CameraSpec,
    size_px: tuple[float, float] | None = None,
) -> View:
    """The view of a trial; without a calibrated lens its axis goes through the middle of the picture.

    The twin's frame is laid on the pool so that both fish, over the kept frames, head the same way and are at the same
    place in the mean: at a single frame each is somewhere else in its beat.

    Args:
        trial: as measured.
        simulated_m: (n, m, 2) of the kept frames, the markers of the twin beside it, m.
        camera: that filmed it.
        size_px: of the picture; default: as the trial alone tells it.
    """
    width_px, height_px = size_px or picture_px([trial], camera)
    lens = camera.calibration
    middle_px = np.array([width_px / 2, height_px / 2] if lens is None else [lens.cx_px, lens.cy_px])
    measured_m = trial.position_m[trial.kept][: len(simulated_m)]
    (line, place), (own_line, own_place) = (_mean_head(each, trial.markers) for each in (measured_m, simulated_m))
    turn = np.angle(line / own_line)
    cos, sin = np.cos(turn), np.sin(turn)
    to_pool = np.array([[cos, -sin], [sin, cos]])  # from the twin's frame
    origin_m = place - to_pool @ own_place
    return View(
        axis_m=(trial.metres_per_px * TO_PX * middle_px - origin_m) @ to_pool,
        down=np.array([0.0, -1.0]) @ to_pool,
        half_height_m=height_px / 2 * trial.metres_per_px,
    )


def _mean_head(position_m: np.ndarray, markers: tuple[str, ...]) -> tuple[complex, np.ndarray]:
    """The mean direction from nose to neck, x + i y, and the mean place (2,) of the nose, of positions (n, m, 2)."""
    nose, neck = (position_m[:, markers.index(name)] for name in ("nose", "neck"))
    line = (neck - nose) / np.linalg.norm(neck - nose, axis=-1, keepdims=True)
    along, across = np.nanmean(line, axis=0)
    return complex(along, across), np.asarray(np.nanmean(nose, axis=0))
