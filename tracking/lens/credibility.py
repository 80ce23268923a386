"""Checks of whether a calibrated lens can be believed: its uncertainty and its flags."""

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np

from session import Flag
from session.camera import CameraCalibration
from tracking.lens.bundle import inverse, normal_equations
from tracking.lens.corners import Corners
from tracking.lens.lens_fit import LensFit
from tracking.lens.undistort import camera_matrix, folds, to_rays

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
    """Return the standard deviations of a lens fit; `lens` is the same fit as a calibration."""
    covariance = lens_covariance(fit)
    fx, fy, cx, cy, *distortion = np.sqrt(np.diag(covariance)).tolist()
    k1, k2, p1, p2, k3 = distortion
    return LensUncertainty(fx, fy, cx, cy, (k1, k2, p1, p2, k3), _bend(covariance, lens))


def lens_covariance(fit: LensFit) -> np.ndarray:
    """Return the (9, 9) covariance of fx, fy, cx, cy, k1, k2, p1, p2, k3; zero for what was not fitted."""
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


TILES = (8, 6)
"""Tiles across and down the picture in which corners are looked for."""
GOOD_VIEWS = 8
GOOD_COVERAGE = 0.5
TILTED_DEG = 15.0
"""Least angle between two views: errors grow steeply below it (Zhang 2000, section 4 and figure 4)."""
FOCAL_SD = 0.01
"""Largest relative standard deviation of the focal length: the lens's height, and so parallax, is known no better."""
RMS_SHARE = 3e-4
"""Largest RMS of the corners, as a share of the picture's width.

Good corners of a 3840 px wide picture are off by about 1 px, of a 1920 px one by 0.5 px.
"""
BEND_SHARE = 5e-4
"""Largest uncertainty of the shape, as a share of the picture's width: 1 mm of a pool 2 m wide."""


def coverage_of(corners: Iterable[Corners], width_px: int, height_px: int) -> float:
    """Return the share of the picture's tiles in which a corner was seen.

    Args:
        corners: the corners of each view.
        width_px: width of the picture.
        height_px: height of the picture.
    """
    image_px = np.concatenate([seen.image_px for seen in corners])
    tile = np.floor((image_px + 0.5) / [width_px, height_px] * TILES).astype(int)
    tile = np.clip(tile, 0, np.array(TILES) - 1)
    return len(np.unique(tile, axis=0)) / (TILES[0] * TILES[1])


def spread_deg(rotation: np.ndarray) -> float:
    """Return the largest angle between the planes of two of the views, given their (v, 3) rotation vectors."""
    normal = np.array([cv2.Rodrigues(one)[0][:, 2] for one in rotation])  # (v, 3)
    return float(np.degrees(np.arccos(np.clip(normal @ normal.T, -1.0, 1.0))).max())


def calibration_flags(fit: LensFit, camera: CameraCalibration, sd: LensUncertainty) -> tuple[Flag, ...]:
    """List the reasons not to believe a lens fit, each with its number and what to do.

    Args:
        fit: the fit.
        camera: the same fit as a calibration.
        sd: its standard deviations.
    """
    views, coverage = len(fit.bundle.corners), coverage_of(fit.bundle.corners, camera.width_px, camera.height_px)
    angle, focal = spread_deg(fit.bundle.poses[:, :3]), max(sd.fx_px / camera.fx_px, sd.fy_px / camera.fy_px)
    most_rms, most_bend = (share * camera.width_px for share in (RMS_SHARE, BEND_SHARE))
    doubts = (
        ("lens_few_views", views < GOOD_VIEWS),
        ("lens_coverage", coverage < GOOD_COVERAGE),
        ("lens_parallel_views", angle < TILTED_DEG or focal > FOCAL_SD),
        ("lens_rms", fit.rms_px > most_rms),
        ("lens_uncertain", sd.bend_px > most_bend),
        ("lens_folds", folds(camera)),
    )
    messages = {
        "lens_few_views": f"the lens rests on {views} pictures; take {GOOD_VIEWS} at least",
        "lens_coverage": f"the board was seen in {100 * coverage:.0f} % of the picture only; elsewhere the lens is "
        "extrapolated: hold the board in the corners and at the edges too",
        "lens_parallel_views": f"the board's planes differ by {angle:.0f} degrees at most, and the focal length is "
        f"known to {100 * focal:.2g} %; parallel views do not determine it: tilt the board by 20 to 45 degrees",
        "lens_rms": f"corners are off by {fit.rms_px:.2f} px, more than {most_rms:.2f} px: the board is not flat, the "
        "pictures are blurred, or the lens bends more than five coefficients can describe",
        "lens_uncertain": f"the shape of the picture is known to {sd.bend_px:.2f} px at its worst place, more than "
        f"{most_bend:.2f} px: take more pictures, with the board near the edges",
        "lens_folds": "the distortion turns back within the picture: it has no meaning near the corners",
    }
    return tuple(Flag(kind, message=messages[kind]) for kind, doubtful in doubts if doubtful)
