"""Fitting a lens to corners: bundle adjustment, with as many distortion coefficients as the corners support."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from tracking.lens.bundle import Bundle, polished
from tracking.lens.corners import Corners

MODELS = {
    "k1": (True, False, False, False, False),
    "k1 k2": (True, True, False, False, False),
    "k1 k2 p1 p2": (True, True, True, True, False),
    "k1 k2 p1 p2 k3": (True, True, True, True, True),
}
"""Which of OpenCV's coefficients k1, k2, p1, p2, k3 are free, from the plainest lens on."""

WIDTHS = (0.2, 20.0)
"""Focal lengths that a start may have, in widths of the picture."""


@dataclass(frozen=True, eq=False)
class LensFit:
    """A lens and where the board was in each of v views."""

    model: str  # one of `MODELS`
    bundle: Bundle  # lens, poses and corners at the optimum

    @property
    def free(self) -> np.ndarray:
        """Which of fx, fy, cx, cy, k1, k2, p1, p2, k3 were fitted, (9,) bool."""
        return _free(self.model)

    @property
    def parameters(self) -> int:
        """Number of fitted numbers, poses included."""
        return int(self.free.sum()) + 6 * len(self.bundle.corners)

    @property
    def rms_px(self) -> float:
        """Root mean square distance between found and projected corners (as OpenCV has it)."""
        return float(np.sqrt(self.bundle.sum_of_squares / (self.bundle.measurements / 2)))

    @property
    def view_rms_px(self) -> np.ndarray:
        """Root mean square distance between found and projected corners of each view, (v,)."""
        return np.array([np.sqrt((residual**2).sum(axis=1).mean()) for residual in self.bundle.residuals_px])

    @property
    def information_criterion(self) -> float:
        """Bayesian information criterion (Schwarz, Annals of Statistics 6, 1978); smaller is better."""
        n = self.bundle.measurements
        return float(n * np.log(max(self.bundle.sum_of_squares / n, 1e-12)) + self.parameters * np.log(n))


def fit_lens(corners: Sequence[Corners], width_px: int, height_px: int) -> LensFit:
    """Fit the lens model that the views support best, by the Bayesian information criterion over `MODELS`.

    Zhang, "A Flexible New Technique for Camera Calibration", IEEE PAMI 22, 2000. Each model starts from the one before
    it.

    Args:
        corners: the corners of each view.
        width_px: width of the picture.
        height_px: height of the picture.
    """
    bundle = _start(corners, (width_px, height_px))
    fits = []
    for model in MODELS:
        bundle = polished(bundle, _free(model))
        fits.append(LensFit(model, bundle))
    return min(fits, key=lambda fit: fit.information_criterion)


def _free(model: str) -> np.ndarray:
    return np.array([True, True, True, True, *MODELS[model]])


def _start(corners: Sequence[Corners], size: tuple[int, int]) -> Bundle:
    """Fit the plainest lens with OpenCV, as a start.

    It is only the start: both solvers of OpenCV 5.0 stop short of the optimum, up to twenty standard deviations of the
    principal point from it, when the principal point and the tangential coefficients are fitted together.
    """
    places = [np.array(seen.place_m, dtype=np.float32).reshape(-1, 1, 3) for seen in corners]
    images = [np.array(seen.image_px, dtype=np.float32).reshape(-1, 1, 2) for seen in corners]
    matrix = _first_matrix(places, images, size)
    flags = cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_DISABLE_SCHUR_COMPLEMENT
    flags |= cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST
    _, matrix, distortion, rotation, translation = cv2.calibrateCamera(
        places, images, size, matrix, np.zeros(5), flags=flags
    )
    lens = np.concatenate([matrix[[0, 1, 0, 1], [0, 1, 2, 2]], np.ravel(distortion)[:5]])
    poses = np.concatenate([np.reshape(rotation, (-1, 3)), np.reshape(translation, (-1, 3))], axis=1)
    return Bundle(lens, poses, tuple(corners))


def _first_matrix(places: list[np.ndarray], images: list[np.ndarray], size: tuple[int, int]) -> np.ndarray:
    """Return a first (3, 3) camera matrix: focal length from the homographies, or the picture's width if they fail."""
    guess = cv2.initCameraMatrix2D(places, images, size)
    focal = float(np.median([guess[0, 0], guess[1, 1]]))
    if not WIDTHS[0] * size[0] < focal < WIDTHS[1] * size[0]:  # also where it is nan
        focal = float(size[0])
    return np.array([[focal, 0.0, (size[0] - 1) / 2], [0.0, focal, (size[1] - 1) / 2], [0.0, 0.0, 1.0]])
