"""Doubts about a session's camera, for the results and the report."""

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
    """List the doubts about the lens, each with its likely size.

    Args:
        camera: the camera table of the session.
        picture_px: width and height of the video, to compare with those of the calibration.
        metres_per_px: scale of the tracks, to compare with the camera's height.
    """
    lens = camera.calibration
    if lens is None:
        return (_uncalibrated_flag(),)
    size, height_m, flags = (lens.width_px, lens.height_px), lens.height_above_water_m, []
    if folds(lens):
        what = "the lens's distortion turns back within the picture"
        flags.append(Flag("lens_folds", message=f"{what}: near the corners it has no meaning; calibrate again"))
    if picture_px is not None and picture_px != size:
        message = (
            f"the lens was calibrated for pictures of {size[0]} x {size[1]}, the video has {picture_px[0]} x "
            f"{picture_px[1]}: undistortion is wrong; calibrate in the mode of the video"
        )
        flags.append(Flag("lens_other_size", message=message))
    if metres_per_px is not None and height_m is not None:  # the scale is H / f on the plane of nose and neck
        height = lens.fx_px * metres_per_px
        if abs(height / height_m - 1) > HEIGHT_OFF:
            message = (
                f"[camera] height_above_water_m is {height_m:g} m, but the scale of the tracks and the focal "
                f"length put the lens {height:.3g} m above nose and neck: check the height, scale_length_m, and that "
                "the lens was calibrated in the mode of the video"
            )
            flags.append(Flag("camera_height_off_scale", message=message))
    if height_m is None:
        message = (
            "the camera's height is not known, so markers above the others (dorsal and caudal fin, 50 mm) appear too "
            "far out: by 1.7 % of their distance from the middle under a camera 3 m up. Give [camera] "
            "height_above_water_m"
        )
        flags.append(Flag("no_camera_height", message=message))
    return tuple(flags)


def _uncalibrated_flag() -> Flag:
    shift = LINEAR_K1 * HALF_WIDTH**2 / 2  # over the picture's width: k1 t^3 / (2 t), half a picture from its middle
    stretch = 3 * LINEAR_K1 * HALF_WIDTH**2  # stretches a length along the radius: the derivative of t + k1 t^3
    message = (
        f"the lens is not calibrated. At a radial distortion of {LINEAR_K1:g}, which a linear field of view may "
        f"leave, places at the left and right edge are off by {100 * shift:.1f} % of the picture's width and "
        f"lengths there by {100 * stretch:.0f} %; a wide field of view bends ten times as much. Calibrate it "
        "with a ChArUco board, or swim near the middle"
    )
    return Flag("no_lens", message=message)


def save_camera(path: Path, calibration: CameraCalibration) -> None:
    """Write a camera file, whole or not at all; `session.camera.load_camera` reads the same numbers back.

    Raises:
        ResultsNotWritable: the file cannot be written.
    """
    write_whole(path, tomlkit.dumps({"camera": calibration.model_dump(mode="json", exclude_none=True)}))
