"""From pixels to metres on the pool: lens, parallax, scale, and the change to a right-handed frame seen from above."""

import numpy as np
import xarray as xr

from session import CameraSpec, InputError, NotEnoughData
from session.camera import CameraCalibration
from session.errors import Fault
from session.tracks import markers_of, pixels_of
from tracking.lens.parallax import true_over_apparent
from tracking.lens.undistort import to_rays


def to_pool(
    tracks: xr.Dataset,
    camera: CameraSpec,
    weight: np.ndarray | None = None,
    marker_height_m: np.ndarray | None = None,
) -> tuple[np.ndarray, float]:
    """Scales tracks by the median nose-neck distance, after undoing the lens and the parallax where they are known.

    "Simple Models, Real Swimming" (2026): pixels become metres by the nose-neck distance.

    Parallax is undone when the markers' heights are given and the camera file has a `height_above_water_m`. What is
    assumed then: the camera looks straight down, the robot is level, and the plane of nose and neck, which gives the
    scale, is the surface of the water. Markers above it are in air; those below it are seen through the surface,
    with Snell's refraction (see `tracking.lens.parallax`). Nose and neck themselves are not moved when they are
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
    """(n, m, 2) where an ideal camera with square pixels would see each marker's foot on the reference plane, px."""
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
