"""What is doubtful about a session's camera, for the results and the report."""

from pathlib import Path

import tomlkit

from session import CameraSpec, Flag
from session.camera import CameraCalibration
from session.results import write_whole
from tracking.lens.undistort import folds

LINEAR_K1 = 0.02
"""Radial distortion k1 that the "linear" mode of an action camera may leave: our assumption for the size in the
message, not a measurement of any camera."""
HALF_WIDTH = 18 / 19
"""Half the picture's width over the focal length: that of a 19 mm lens on film 36 mm wide, the widest linear field of
view of the camera that the swim trials were filmed with (87 degrees)."""
HEIGHT_OFF = 0.05
"""Relative difference between two ways to the camera's height that is worth a flag."""


def lens_flags(
    camera: CameraSpec, *, picture_px: tuple[int, int] | None = None, metres_per_px: float | None = None
) -> tuple[Flag, ...]:
    """Doubts about the lens, each with its likely size.

    Args:
        camera: as the session has it.
        picture_px: width and height of the video, where known: does the calibration belong to it?
        metres_per_px: the scale of the tracks, where known: does the camera's height fit it?
    """
    lens = camera.calibration
    if lens is None:
        return (_not_calibrated(),)
    found = [_folds(lens), _other_size(lens, picture_px), _other_height(lens, metres_per_px), _no_height(lens)]
    return tuple(flag for flag in found if flag is not None)


def _not_calibrated() -> Flag:
    shift = LINEAR_K1 * HALF_WIDTH**2 / 2  # over the picture's width: k1 t^3 / (2 t), half a picture from its middle
    stretch = 3 * LINEAR_K1 * HALF_WIDTH**2  # of a length along the radius: the derivative of t + k1 t^3
    message = (
        f"the lens is not calibrated. At a radial distortion of {LINEAR_K1:g}, which a linear field of view may "
        f"leave, places at the left and right edge are off by {100 * shift:.1f} % of the picture's width and "
        f"lengths there by {100 * stretch:.0f} %; a wide field of view bends ten times as much. Calibrate it "
        "with a ChArUco board, or swim near the middle"
    )
    return Flag("no_lens", message=message)


def _folds(lens: CameraCalibration) -> Flag | None:
    if not folds(lens):
        return None
    message = "the lens's distortion turns back within the picture: near the corners it has no meaning; calibrate again"
    return Flag("lens_folds", message=message)


def _other_size(lens: CameraCalibration, picture_px: tuple[int, int] | None) -> Flag | None:
    size = (lens.width_px, lens.height_px)
    if picture_px is None or picture_px == size:
        return None
    message = (
        f"the lens was calibrated for pictures of {size[0]} x {size[1]}, the video has {picture_px[0]} x "
        f"{picture_px[1]}: undistortion is wrong; calibrate in the mode of the video"
    )
    return Flag("lens_other_size", message=message)


def _no_height(lens: CameraCalibration) -> Flag | None:
    if lens.height_above_water_m is not None:
        return None
    message = (
        "the camera's height is not known, so markers above the others (dorsal and caudal fin, 50 mm) appear too far "
        "out: by 1.7 % of their distance from the middle under a camera 3 m up. Give [camera] height_above_water_m"
    )
    return Flag("no_camera_height", message=message)


def _other_height(lens: CameraCalibration, metres_per_px: float | None) -> Flag | None:
    """The scale is H / f on the plane of nose and neck: two ways to the camera's height."""
    if metres_per_px is None or lens.height_above_water_m is None:
        return None
    height = lens.fx_px * metres_per_px
    if abs(height / lens.height_above_water_m - 1) <= HEIGHT_OFF:
        return None
    message = (
        f"[camera] height_above_water_m is {lens.height_above_water_m:g} m, but the scale of the tracks and the focal "
        f"length put the lens {height:.3g} m above nose and neck: check the height, scale_length_m, and that the lens "
        "was calibrated in the mode of the video"
    )
    return Flag("camera_height_off_scale", message=message)


def save_camera(path: Path, calibration: CameraCalibration) -> None:
    """Writes a camera file, whole or not at all; `session.load_camera` reads the same numbers back.

    Raises:
        ResultsNotWritable: the file cannot be written.
    """
    table = tomlkit.table()
    for key, value in calibration.model_dump(exclude_none=True).items():
        table[key] = list(value) if isinstance(value, tuple) else value
    document = tomlkit.document()
    document["camera"] = table
    write_whole(path, tomlkit.dumps(document))
