"""The camera's way from pixels to metres on the pool: lens, parallax and scale.

`to_pool` undoes the lens (`to_rays`) and the parallax (`true_over_apparent`) where they are known, scales, and changes
to a right-handed frame seen from above. `lens_flags` lists the doubts about a session's camera, for the results and the
report.

Parallax is that of markers above or below the reference plane, seen by a camera that looks straight down. The reference
plane is the plane of the nose and neck markers, which give the picture its scale; it is taken to be the surface of the
water, for the robot swims at it (the built-in robot's nose and neck are 2.5 mm below the top of its submerged part).
The camera is H above it, its axis vertical, the robot level.

A marker z above the plane is in air. It is (H - z) t from the camera's foot, t being the slope of its ray, where on
the plane one would read H t: it appears too far out by H / (H - z). A marker d below is seen through the surface:
its ray meets the water H t from the foot and goes on at the slope that Snell's law gives, sin a = n sin b,

    distance = t (H + d / sqrt(n^2 + (n^2 - 1) t^2)),

near the foot t (H + d / n), the apparent depth. A flat surface is assumed: ripple is noise here.
"""

import cv2
import numpy as np
import xarray as xr

from swimcal.errors import Fault, InputError, NotEnoughData
from swimcal.flags import Flag
from swimcal.session_file import CameraCalibration, CameraSpec
from swimcal.tracks import markers_of, pixels_of
from tracking.lens_check import MeasuredDistortion, measure_distortion

STOP = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 100, 1e-12)
"""Stop of the iterations: OpenCV's own five leave whole pixels at the edge of a wide-angle picture."""

WATER_INDEX = 1.333
"""Refractive index of water for visible light, 20 degrees Celsius (CRC Handbook of Chemistry and Physics)."""

# Flags of a session's camera.
LINEAR_K1 = 0.02
"""Radial distortion k1 that the "linear" mode of an action camera may leave: our assumption for the size in the
message, not a measurement of any camera."""
HALF_WIDTH = 18 / 19
"""Half the picture's width over the focal length: that of a 19 mm lens on film 36 mm wide, the widest linear field of
view of the camera that the swim trials were filmed with (87 degrees)."""
STRETCHED = 0.01
"""Relative stretch of lengths at the farthest marker from which a lens that is not calibrated is flagged: as much as
the millimetre or two to which a ruler gives nose to neck."""
_SURE_SD = 4.0  # standard deviations from which a swim is said to show that the lens bends
HEIGHT_OFF = 0.05
"""Relative difference between two ways to the camera's height that is worth a flag."""


def camera_matrix(lens: CameraCalibration) -> np.ndarray:
    """Return the (3, 3) matrix of the pinhole camera, px."""
    return np.array([[lens.fx_px, 0.0, lens.cx_px], [0.0, lens.fy_px, lens.cy_px], [0.0, 0.0, 1.0]])


def to_rays(position_px: np.ndarray, lens: CameraCalibration) -> np.ndarray:
    """Turn pixels into the slopes of their rays, in the camera's axes (x right, y down).

    Args:
        position_px: (..., 2) pixels; missing positions (nan) stay missing.
        lens: calibration of the camera.

    Returns:
        (..., 2) slopes x/z, y/z.
    """
    flat = np.ascontiguousarray(position_px, dtype=float).reshape(-1, 1, 2)
    known = np.isfinite(flat).all(axis=(1, 2))
    rays = np.full_like(flat, np.nan)
    if known.any():
        rays[known] = cv2.undistortPoints(flat[known], camera_matrix(lens), np.array(lens.distortion), criteria=STOP)
    return rays.reshape(position_px.shape)


def folds(lens: CameraCalibration) -> bool:
    """Tell whether the lens's radial polynomial turns back within the picture, so that two rays meet in one pixel.

    r_d = r (1 + k1 r^2 + k2 r^4 + k3 r^6) must rise up to the farthest corner of the picture.
    """
    k1, k2, _, _, k3 = lens.distortion
    x, y = np.array([0, lens.width_px - 1]), np.array([0, lens.height_px - 1])
    farthest = np.hypot(np.abs(x - lens.cx_px).max() / lens.fx_px, np.abs(y - lens.cy_px).max() / lens.fy_px)
    turns = np.roots([7 * k3, 5 * k2, 3 * k1, 1.0])  # values of r^2 at which it turns
    real = turns[np.isreal(turns)].real
    if not (real > 0).any():
        return False
    r = np.sqrt(real[real > 0].min())
    return bool(r * (1 + k1 * r**2 + k2 * r**4 + k3 * r**6) < farthest)


def true_over_apparent(ray: np.ndarray, height_m: np.ndarray, camera_height_m: float) -> np.ndarray:
    """Return the ratio of a place's true distance from the camera's foot to its apparent one on the reference plane.

    Args:
        ray: (..., m, 2) slopes of the rays from the camera, undistorted.
        height_m: (m,) or scalar, above the reference plane; negative below it, in water.
        camera_height_m: height H of the lens above the reference plane.

    Returns:
        (..., m) factors; 1 on the plane.

    Raises:
        ValueError: a place at the height of the camera or above it.
    """
    height_m = np.asarray(height_m, dtype=float)
    if (height_m >= camera_height_m).any():
        raise ValueError(f"{height_m.max():g} m above the plane is not below the camera at {camera_height_m:g} m")
    squared_slope = (ray**2).sum(axis=-1)  # (..., m)
    above = np.maximum(height_m, 0.0) / camera_height_m
    below = np.maximum(-height_m, 0.0) / camera_height_m
    return 1.0 - above + below / np.sqrt(WATER_INDEX**2 + (WATER_INDEX**2 - 1.0) * squared_slope)


def to_pool(
    tracks: xr.Dataset,
    camera: CameraSpec,
    weight: np.ndarray | None = None,
    marker_height_m: np.ndarray | None = None,
) -> tuple[np.ndarray, float]:
    """Scale tracks by the median nose-neck distance, after undoing the lens and the parallax where they are known.

    "Simple Models, Real Swimming" (2026): pixels become metres by the nose-neck distance.

    Parallax is undone when the markers' heights are given and the camera file has a `height_above_water_m`. What is
    assumed then: the camera looks straight down, the robot is level, and the plane of nose and neck, which gives the
    scale, is the surface of the water. Markers above it are in air; those below it are seen through the surface,
    with Snell's refraction. Nose and neck themselves are not moved when they are
    equally high.

    Returns:
        (n, m, 2) markers on the plane of the pool, x to the right of the image, y up in the image (so z points to the
        camera), m; and the scale used, m/px.

    Args:
        tracks: n frames of m markers, with nose and neck among them.
        camera: clock, scale length and lens.
        weight: (n, m) samples of weight 0 do not count for the scale; default all count.
        marker_height_m: (m,) z of the markers in the robot frame; only differences to nose and neck matter.

    Raises:
        InputError: the camera is not above the markers.
        NotEnoughData: nose and neck are never seen both, apart from each other.
    """
    position_px = _on_plane(tracks, camera, marker_height_m)
    nose, neck = markers_of(tracks).index("nose"), markers_of(tracks).index("neck")
    span_px = np.linalg.norm(position_px[:, neck] - position_px[:, nose], axis=1)  # (n,)
    good = np.isfinite(span_px) & (span_px > 0)
    if weight is not None and (trusted := good & (weight[:, nose] > 0) & (weight[:, neck] > 0)).any():
        good = trusted
    if not good.any():
        raise NotEnoughData("nose and neck are never seen apart, so the tracks have no scale; track them again")
    scale = camera.scale_length_m / float(np.median(span_px[good]))
    return position_px * np.array([scale, -scale]), scale


def _on_plane(tracks: xr.Dataset, camera: CameraSpec, marker_height_m: np.ndarray | None) -> np.ndarray:
    """Return px (n, m, 2) where an ideal camera with square pixels sees each marker's foot on the reference plane."""
    lens = camera.calibration
    if lens is None:
        return pixels_of(tracks)
    rays = to_rays(pixels_of(tracks), lens)  # (n, m, 2)
    if marker_height_m is not None and lens.height_above_water_m is not None:
        height_m = marker_height_m - np.mean(
            [marker_height_m[markers_of(tracks).index(name)] for name in ("nose", "neck")]
        )
        _check_below_camera(height_m, lens, camera)
        rays = rays * true_over_apparent(rays, height_m, lens.height_above_water_m)[..., None]
    return lens.fx_px * rays + [lens.cx_px, lens.cy_px * lens.fx_px / lens.fy_px]


def _check_below_camera(height_m: np.ndarray, lens: CameraCalibration, camera: CameraSpec) -> None:
    if lens.height_above_water_m is not None and height_m.max() >= lens.height_above_water_m:
        file, where = str(camera.file or "the camera"), "camera.height_above_water_m"
        what, found = "the lens is not above the markers", f"{lens.height_above_water_m:g}"
        expected = f"more than {height_m.max():g}, the height of the highest marker above nose and neck"
        step = "Is it in metres, from the surface of the water to the lens?"
        raise InputError([Fault(file, where, what, found, expected, next_step=step)])


def lens_flags(
    camera: CameraSpec,
    tracks: xr.Dataset,
    picture_px: tuple[int, int] | None = None,
    metres_per_px: float | None = None,
) -> tuple[Flag, ...]:
    """List the doubts about the lens, each with its likely size.

    Args:
        camera: the camera table of the session.
        tracks: tracks, with confidence 0 where a sample must not be trusted.
        picture_px: width and height of the video, to compare with those of the calibration.
        metres_per_px: scale of the tracks, to compare with the camera's height.
    """
    lens = camera.calibration
    if lens is None:
        return _flag_no_lens(None if picture_px is None else measure_distortion(tracks, picture_px, HALF_WIDTH))
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


def _flag_no_lens(seen: MeasuredDistortion | None) -> tuple[Flag, ...]:
    """Flag a lens that is not calibrated, unless the swim itself shows that it bends little."""
    if seen is not None and seen.stretch < STRETCHED:
        return ()
    step = "Calibrate it with a ChArUco board, or swim near the middle"
    if seen is not None and abs(seen.k1) > _SURE_SD * seen.sd:
        longer = "longer" if seen.k1 > 0 else "shorter"
        message = (
            f"the lens is not calibrated, and nose to neck appears {longer} towards the edges of the picture, by "
            f"{100 * seen.over_swim:.1f} % over this swim: by the lens, or a robot that rises or dives. {step}"
        )
        return (Flag("no_lens", message=message),)
    # Over the picture's width: k1 t^3 / (2 t), half a picture from its middle
    shift = LINEAR_K1 * HALF_WIDTH**2 / 2
    stretch = 3 * LINEAR_K1 * HALF_WIDTH**2  # stretches a length along the radius: the derivative of t + k1 t^3
    message = (
        f"the lens is not calibrated. At a radial distortion of {LINEAR_K1:g}, which a linear field of view may "
        f"leave, places at the left and right edge are off by {100 * shift:.1f} % of the picture's width and "
        f"lengths there by {100 * stretch:.0f} %; a wide field of view bends ten times as much. {step}"
    )
    return (Flag("no_lens", message=message),)
