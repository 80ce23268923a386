"""The lens of a camera: calibrated, and flagged where its file does not fit the film.

`calibrate_lens` calibrates it from pictures of a board: the lens, how good it is, and which pictures it rests on.
`lens_flags` lists doubts about a session's camera, for the results and the report.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tomlkit

from swimcal.errors import NotEnoughData
from swimcal.flags import Flag
from swimcal.results import write_whole
from swimcal.session_file import CameraCalibration, CameraSpec
from tracking.board import BoardSpec, Corners, each_picture, find_corners
from tracking.camera import folds
from tracking.lens_fit import (
    RMS_SHARE,
    LensFit,
    LensUncertainty,
    calibration_flags,
    coverage_of,
    fit_lens,
    lens_uncertainty,
)

# The calibration.
LEAST_CORNERS = 8
"""Least number of corners: fewer determine little more than the pose of the board."""
LEAST_VIEWS = 3
"""Least number of views: each gives two equations for the camera's four numbers or more (Zhang 2000, section 3.1)."""
OUTLYING_VIEW = 3.0
"""A view is left out whose corners are off by this many times the usual."""
OUTLYING_PX = 0.3
"""A view whose corners are off by less than this is never left out."""

# Flags of a session's camera.
LINEAR_K1 = 0.02
"""Radial distortion k1 that the "linear" mode of an action camera may leave: our assumption for the size in the
message, not a measurement of any camera."""
HALF_WIDTH = 18 / 19
"""Half the picture's width over the focal length: that of a 19 mm lens on film 36 mm wide, the widest linear field of
view of the camera that the swim trials were filmed with (87 degrees)."""
HEIGHT_OFF = 0.05
"""Relative difference between two ways to the camera's height that is worth a flag."""


@dataclass(frozen=True, eq=False)
class LensCalibration:
    """A calibrated lens.

    Attributes:
        calibration: the camera, for `save_camera`; its height above the water is not known from this.
        rms_px: distance between found and projected corners over all views used.
        pictures: how many were looked at.
        rejected: each that was left out, by its file or its number from 1, and why.
        coverage: share of the picture's 8 x 6 tiles in which a corner was seen.
        sd: standard deviations.
        flags: why it should not be believed, if so.
    """

    calibration: CameraCalibration
    rms_px: float
    pictures: int
    rejected: tuple[str, ...]
    coverage: float
    sd: LensUncertainty
    flags: tuple[Flag, ...]


def calibrate_lens(pictures: Iterable[Path | np.ndarray], board: BoardSpec) -> LensCalibration:
    """Calibrate a lens from pictures of a flat board, held at many angles all over the picture.

    Take frames of a video in the mode used for the swim trials: photographs have another field of view.

    Args:
        pictures: files, or (h, w) or (h, w, 3) RGB uint8 arrays; 15 to 30 are good.
        board: the board as printed and measured.

    Raises:
        InputError: pictures that cannot be read, or differ in size.
        NotEnoughData: the board is found in fewer than three of them.
    """
    names, found, size = [], [], (0, 0)
    for picture in each_picture(pictures):
        names.append(picture.name)
        found.append(find_corners(picture.gray, board))
        size = picture.gray.shape[1], picture.gray.shape[0]
    reasons = {n: _unusable(corners, board) for n, corners in enumerate(found)}
    good = [n for n, reason in reasons.items() if not reason]
    if len(good) < LEAST_VIEWS:
        raise NotEnoughData(
            f"the board was found in {len(good)} of {len(names)} pictures; at least {LEAST_VIEWS} are needed, 15 are "
            f"good. Is it a {board.kind} board of {board.columns} x {board.rows} squares"
            + (f" with markers of {board.dictionary}?" if board.kind == "charuco" else "?")
        )
    fit, used = _without_outliers(found, good, size)
    for n in set(good) - set(used):
        reasons[n] = "its corners do not fit the lens of the other pictures: blurred, moved, or the board was bent"
    fx, fy, cx, cy, k1, k2, p1, p2, k3 = fit.bundle.lens.tolist()
    pinhole = {"width_px": size[0], "height_px": size[1], "fx_px": fx, "fy_px": fy, "cx_px": cx, "cy_px": cy}
    calibration = CameraCalibration(**pinhole, distortion=(k1, k2, p1, p2, k3))
    sd = lens_uncertainty(fit, calibration)
    return LensCalibration(
        calibration=calibration,
        rms_px=fit.rms_px,
        pictures=len(names),
        rejected=tuple(f"{names[n]}: {reason}" for n, reason in reasons.items() if reason),
        coverage=coverage_of(fit.bundle.corners, *size),
        sd=sd,
        flags=calibration_flags(fit, calibration, sd),
    )


def save_camera(path: Path, calibration: CameraCalibration) -> None:
    """Write a camera file, whole or not at all; `swimcal.session_file.load_camera` reads the same numbers back.

    Raises:
        ResultsNotWritable: the file cannot be written.
    """
    write_whole(path, tomlkit.dumps({"camera": calibration.model_dump(mode="json", exclude_none=True)}))


def _unusable(corners: Corners, board: BoardSpec) -> str:
    """Return why a picture cannot be used; an empty text where it can."""
    if len(corners.image_px) == 0:
        return f"no {board.kind} board was found"
    if len(corners.image_px) < LEAST_CORNERS:
        return f"only {len(corners.image_px)} corners were found, {LEAST_CORNERS} are needed"
    spread = np.linalg.svd(corners.place_m[:, :2] - corners.place_m[:, :2].mean(axis=0), compute_uv=False)
    if spread[1] < 1e-6 * spread[0]:
        return "all corners found lie on one line"
    return ""


def _without_outliers(found: Sequence[Corners], good: list[int], size: tuple[int, int]) -> tuple[LensFit, list[int]]:
    """Return the fit after dropping outlying views one by one, and the indices of the views that remain."""
    used, fit = list(good), fit_lens([found[n] for n in good], *size)
    while len(used) > LEAST_VIEWS:
        worst = int(np.argmax(fit.view_rms_px))
        stands_out = fit.view_rms_px[worst] > max(OUTLYING_VIEW * float(np.median(fit.view_rms_px)), OUTLYING_PX)
        if not stands_out and fit.rms_px <= RMS_SHARE * size[0]:
            break
        # A view that is wrong by much spoils the lens for all, and need not stand out itself.
        without = [used[:k] + used[k + 1 :] for k in ([worst] if stands_out else range(len(used)))]
        fits = [fit_lens([found[n] for n in others], *size) for others in without]
        best = int(np.argmin([one.rms_px for one in fits]))
        if not stands_out and fits[best].rms_px > fit.rms_px / 2:
            break
        used, fit = without[best], fits[best]
    return fit, used


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
