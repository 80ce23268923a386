"""From pixels to metres on the pool: lens, scale, and the change to a right-handed frame seen from above."""

from dataclasses import dataclass

import cv2
import numpy as np

from session import CameraCalibration, CameraSpec, NotEnoughData, Tracks


@dataclass(frozen=True, eq=False)
class PoolTracks:
    """Marker tracks on the plane of the pool.

    Attributes:
        markers: names of the m markers.
        time_s: (n,) from the first frame, s.
        position_m: (n, m, 2) x to the right of the image, y up in the image (so z points to the camera), m.
        metres_per_px: the scale used.
        scale_jitter: standard deviation of the nose-neck distance over its median.
    """

    markers: tuple[str, ...]
    time_s: np.ndarray
    position_m: np.ndarray
    metres_per_px: float
    scale_jitter: float


def to_pool(tracks: Tracks, camera: CameraSpec, weight: np.ndarray | None = None) -> PoolTracks:
    """Scales tracks by the median nose-neck distance, after undoing the lens where it is calibrated.

    "Simple Models, Real Swimming" (2026): pixels become metres by the nose-neck distance.

    Args:
        tracks: n frames of m markers, with nose and neck among them.
        camera: clock, scale length and lens.
        weight: (n, m) samples of weight 0 do not count for the scale; default all count.

    Raises:
        NotEnoughData: nose and neck are never seen both, apart from each other.
    """
    position_px = tracks.position_px
    if camera.calibration is not None:
        position_px = undistort(position_px, camera.calibration)
    nose, neck = tracks.markers.index("nose"), tracks.markers.index("neck")
    span_px = np.linalg.norm(position_px[:, neck] - position_px[:, nose], axis=1)  # (n,)
    good = np.isfinite(span_px) & (span_px > 0)
    if weight is not None and (trusted := good & (weight[:, nose] > 0) & (weight[:, neck] > 0)).any():
        good = trusted
    if not good.any():
        raise NotEnoughData("nose and neck are never seen apart, so the tracks have no scale; track them again")
    median_px = float(np.median(span_px[good]))
    scale = camera.scale_length_m / median_px
    return PoolTracks(
        markers=tracks.markers,
        time_s=tracks.time_s - tracks.time_s[0],
        position_m=position_px * np.array([scale, -scale]),
        metres_per_px=scale,
        scale_jitter=float(np.std(span_px[good]) / median_px),
    )


def undistort(position_px: np.ndarray, lens: CameraCalibration) -> np.ndarray:
    """(..., 2) pixels of the distorted image -> pixels of an ideal pinhole camera with the same matrix."""
    matrix = np.array([[lens.fx_px, 0.0, lens.cx_px], [0.0, lens.fy_px, lens.cy_px], [0.0, 0.0, 1.0]])
    flat = position_px.reshape(-1, 1, 2)
    known = np.isfinite(flat).all(axis=(1, 2))
    result = np.full_like(flat, np.nan)
    if known.any():
        result[known] = cv2.undistortPoints(flat[known], matrix, np.array(lens.distortion), P=matrix)
    return result.reshape(position_px.shape)
