"""Bundle adjustment of one camera and a flat board in v poses, by Levenberg and Marquardt with the poses eliminated.

What of a lens parameter's effect a change of pose can mimic is not information; the rest, over all views, gives the
reduced normal equations (Triggs and others, "Bundle Adjustment: A Modern Synthesis", 2000, section 6.1). They serve the
fit and its covariance.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import cv2
import numpy as np

from tracking.lens.corners import Corners

STEPS = 50
ENOUGH = 1e-10
"""Relative decrease of the sum of squares at which the fit has arrived."""


@dataclass(frozen=True, eq=False)
class Bundle:
    """A lens, the poses of the board, and the corners seen."""

    lens: np.ndarray  # (9,) fx, fy, cx, cy, k1, k2, p1, p2, k3; px, and OpenCV's coefficients
    # (v, 6) rotation vector and translation (m), board frame to camera frame (x right, y down, z ahead)
    poses: np.ndarray
    corners: tuple[Corners, ...]  # the v views

    @property
    def matrix(self) -> np.ndarray:
        """Matrix of the pinhole camera, (3, 3), px."""
        fx, fy, cx, cy = self.lens[:4]
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    @cached_property
    def residuals_px(self) -> list[np.ndarray]:
        """Residuals of each view, found minus projected, (k, 2), px."""
        return [
            seen.image_px - self._project(seen, pose)[0].reshape(-1, 2)
            for seen, pose in zip(self.corners, self.poses, strict=True)
        ]

    @property
    def sum_of_squares(self) -> float:
        """Sum of the squared residuals, px^2."""
        return float(sum((residual**2).sum() for residual in self.residuals_px))

    @property
    def measurements(self) -> int:
        """Number of coordinates found."""
        return sum(seen.image_px.size for seen in self.corners)

    def jacobians(self, free: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return each view's derivatives of the coordinates by the pose (2k, 6) and the free lens numbers (2k, p)."""
        found = [self._project(seen, pose)[1] for seen, pose in zip(self.corners, self.poses, strict=True)]
        return [(jacobian[:, :6], jacobian[:, 6:15][:, free]) for jacobian in found]

    def _project(self, seen: Corners, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return cv2.projectPoints(seen.place_m, pose[:3], pose[3:], self.matrix, self.lens[4:])


class NormalEquations(NamedTuple):
    """Normal equations of the free lens numbers, with every pose at its best: matrix (p, p) and gradient (p,)."""

    matrix: np.ndarray
    gradient: np.ndarray


def normal_equations(bundle: Bundle, free: np.ndarray) -> NormalEquations:
    """Return the reduced normal equations.

    Args:
        bundle: the lens, the poses and the corners.
        free: (9,) which of the lens's numbers are fitted.
    """
    matrix, gradient = np.zeros((free.sum(), free.sum())), np.zeros(free.sum())
    for (pose, lens), residual in zip(bundle.jacobians(free), bundle.residuals_px, strict=True):
        basis = np.linalg.qr(pose)[0]
        own = lens - basis @ (basis.T @ lens)
        matrix += own.T @ own
        gradient += own.T @ residual.ravel()
    return NormalEquations(matrix, gradient)


def polished(bundle: Bundle, free: np.ndarray) -> Bundle:
    """Return the bundle at the nearest optimum.

    Args:
        bundle: the start.
        free: (9,) which of the lens's numbers are fitted; all poses are.
    """
    damping = 1e-6
    for _ in range(STEPS):
        step = _step(bundle, free, damping)
        if (gain := 1 - step.sum_of_squares / max(bundle.sum_of_squares, 1e-30)) > 0:
            bundle, damping = step, damping / 10
        elif damping > 1e3:
            break
        else:
            damping = max(10 * damping, 1e-6)
        if 0 <= gain < ENOUGH:
            break
    return bundle


def _step(bundle: Bundle, free: np.ndarray, damping: float) -> Bundle:
    normal = normal_equations(bundle, free)
    change = inverse(normal.matrix + damping * np.diag(np.diag(normal.matrix))) @ normal.gradient  # (p,)
    lens, poses = bundle.lens.copy(), bundle.poses.copy()
    lens[free] += change
    for n, (pose, own) in enumerate(bundle.jacobians(free)):
        poses[n] += np.linalg.lstsq(pose, bundle.residuals_px[n].ravel() - own @ change, rcond=None)[0]
    return replace(bundle, lens=lens, poses=poses)


def inverse(normal: np.ndarray) -> np.ndarray:
    """Return the inverse of a normal matrix whose unknowns have very different units."""
    scale = 1 / np.sqrt(np.maximum(np.diag(normal), 1e-30))
    return scale[:, None] * np.linalg.pinv(scale[:, None] * normal * scale, rcond=1e-14, hermitian=True) * scale
