"""The turn that brings measured markers closest to simulated ones."""

import numpy as np

from fitting.mean_distance import SOFTENING_M


def best_yaw(simulated: np.ndarray, measured: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """(s,) turn of the measured markers (k, m, 2) that brings them closest to simulated ones (s, k, m, 2), rad.

    Closest in mean distance: a weighted Procrustes rotation about the origin, reweighted a few times.
    """
    known, weight = np.nan_to_num(measured), np.where(np.isfinite(measured).all(axis=-1), weight, 0.0)
    angle = np.zeros(len(simulated))
    for _ in range(4):
        distance = np.linalg.norm(simulated - turn(known, angle[:, None, None]), axis=-1)
        pull = np.nan_to_num(weight / np.sqrt(distance**2 + SOFTENING_M**2))
        cross = known[..., 0] * simulated[..., 1] - known[..., 1] * simulated[..., 0]
        dot = (known * simulated).sum(axis=-1)
        angle = np.arctan2((pull * np.nan_to_num(cross)).sum(axis=(1, 2)), (pull * np.nan_to_num(dot)).sum(axis=(1, 2)))
    return angle


def turn(points: np.ndarray, angle_rad: np.ndarray) -> np.ndarray:
    """(..., 2) points turned counter-clockwise about the origin; the angles broadcast against the leading axes."""
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    x, y = points[..., 0], points[..., 1]
    return np.stack([x * cos - y * sin, x * sin + y * cos], axis=-1)
