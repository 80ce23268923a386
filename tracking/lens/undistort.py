"""The lens as a function: from pixels to rays and back."""

import cv2
import numpy as np

from session.camera import CameraCalibration

STOP = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 100, 1e-12)
"""Stop of the iterations: OpenCV's own five leave whole pixels at the edge of a wide-angle picture."""


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
