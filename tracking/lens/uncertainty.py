"""How well the views determine a lens: standard deviations of its numbers, and of the shape it gives a picture."""

from dataclasses import dataclass

import cv2
import numpy as np

from session import CameraCalibration
from tracking.lens.bundle import inverse, normal_equations
from tracking.lens.lens_fit import LensFit
from tracking.lens.undistort import camera_matrix, to_rays

GRID = (13, 9)
"""Places across and down the picture at which the shape is judged."""


@dataclass(frozen=True, eq=False)
class LensUncertainty:
    """Standard deviations from independent corner errors of equal size, estimated from the residuals.

    Attributes:
        fx_px, fy_px, cx_px, cy_px: of the pinhole camera.
        distortion: (5,) of k1, k2, p1, p2, k3; 0 for a coefficient that was not fitted.
        bend_px: worst over the picture, an axis: how far a place may be off after the lens is undone and the
            whole picture is moved, turned and scaled as fits best (tracks get place and scale from elsewhere).
    """

    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    distortion: tuple[float, float, float, float, float]
    bend_px: float


def lens_uncertainty(fit: LensFit, lens: CameraCalibration) -> LensUncertainty:
    """The uncertainty of a fit; `lens` is the fit as a calibration."""
    covariance = lens_covariance(fit)
    fx, fy, cx, cy, *distortion = np.sqrt(np.diag(covariance)).tolist()
    k1, k2, p1, p2, k3 = distortion
    return LensUncertainty(fx, fy, cx, cy, (k1, k2, p1, p2, k3), _bend(covariance, lens))


def lens_covariance(fit: LensFit) -> np.ndarray:
    """(9, 9) covariance of fx, fy, cx, cy, k1, k2, p1, p2, k3; zero for what was not fitted."""
    variance = fit.bundle.sum_of_squares / max(fit.bundle.measurements - fit.parameters, 1)  # px^2, an axis
    covariance = np.zeros((9, 9))
    covariance[np.ix_(fit.free, fit.free)] = variance * inverse(normal_equations(fit.bundle, fit.free).matrix)
    return covariance


def _bend(covariance: np.ndarray, lens: CameraCalibration) -> float:
    x = np.linspace(0, lens.width_px - 1, GRID[0])
    y = np.linspace(0, lens.height_px - 1, GRID[1])
    pixel = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    ray = to_rays(pixel, lens)
    point = np.column_stack([ray, np.ones(len(ray))])
    at_rest = np.zeros(3)
    jacobian = cv2.projectPoints(point, at_rest, at_rest, camera_matrix(lens), np.array(lens.distortion))[1]
    moved, lens_modes = jacobian[:, 3:5].reshape(-1, 2, 2), jacobian[:, 6:15]  # d px / d ray, (2g, 9)
    one, zero = np.ones(len(ray)), np.zeros(len(ray))
    shift = np.stack([np.stack([one, zero]), np.stack([zero, one]), ray.T, np.stack([-ray[:, 1], ray[:, 0]])])
    similar = np.einsum("gij,sjg->gis", moved, shift).reshape(-1, 4)  # (2g, 4) move, move, scale, turn
    basis = np.linalg.qr(similar)[0]
    modes = lens_modes - basis @ (basis.T @ lens_modes)
    variance = np.einsum("ij,jk,ik->i", modes, covariance, modes).reshape(-1, 2).mean(axis=1)
    return float(np.sqrt(variance.max()))
