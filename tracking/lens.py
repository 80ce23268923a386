"""Calibration of a lens from pictures of the board, with its covariance and how far it can be believed.

`fit_lens` fits with as many distortion coefficients as the corners support, by bundle adjustment of one camera and a
flat board in v poses: Levenberg and Marquardt with the poses eliminated. What of a lens parameter's effect a change of
pose can mimic is not information; the rest, over all views, gives the reduced normal equations (Triggs and others,
"Bundle Adjustment: A Modern Synthesis", 2000, section 6.1). They serve the fit and its covariance. `lens_uncertainty`
and `calibration_flags` say whether the result can be believed.

`calibrate_lens` does all this for pictures: the lens, how good it is, and which pictures it rests on.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import cv2
import numpy as np
import tomlkit

from swimcal.errors import NotEnoughData
from swimcal.flags import Flag
from swimcal.results import write_whole
from swimcal.session_file import CameraCalibration
from tracking.board import BoardSpec, Corners, each_picture, find_corners
from tracking.camera import camera_matrix, folds, to_rays

# The bundle adjustment.
STEPS = 50
ENOUGH = 1e-10
"""Relative decrease of the sum of squares at which the fit has arrived."""

# The models of a lens.
MODELS = {
    "k1": (True, False, False, False, False),
    "k1 k2": (True, True, False, False, False),
    "k1 k2 p1 p2": (True, True, True, True, False),
    "k1 k2 p1 p2 k3": (True, True, True, True, True),
}
"""Which of OpenCV's coefficients k1, k2, p1, p2, k3 are free, from the plainest lens on."""

WIDTHS = (0.2, 20.0)
"""Focal lengths that a start may have, in widths of the picture."""

# The uncertainty, and what of a calibration is good enough.
GRID = (13, 9)
"""Places across and down the picture at which the shape is judged."""

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

# The calibration.
LEAST_CORNERS = 8
"""Least number of corners: fewer determine little more than the pose of the board."""
LEAST_VIEWS = 3
"""Least number of views: each gives two equations for the camera's four numbers or more (Zhang 2000, section 3.1)."""
OUTLYING_VIEW = 3.0
"""A view is left out whose corners are off by this many times the usual."""
OUTLYING_PX = 0.3
"""A view whose corners are off by less than this is never left out."""


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


def normal_equations(bundle: Bundle, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the reduced normal equations, with every pose at its best: matrix (p, p) and gradient (p,).

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
    return matrix, gradient


def refine_bundle(bundle: Bundle, free: np.ndarray) -> Bundle:
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


def inverse(normal: np.ndarray) -> np.ndarray:
    """Return the inverse of a normal matrix whose unknowns have very different units."""
    scale = 1 / np.sqrt(np.maximum(np.diag(normal), 1e-30))
    return scale[:, None] * np.linalg.pinv(scale[:, None] * normal * scale, rcond=1e-14, hermitian=True) * scale


def _step(bundle: Bundle, free: np.ndarray, damping: float) -> Bundle:
    matrix, gradient = normal_equations(bundle, free)
    change = inverse(matrix + damping * np.diag(np.diag(matrix))) @ gradient  # (p,)
    lens, poses = bundle.lens.copy(), bundle.poses.copy()
    lens[free] += change
    for n, (pose, own) in enumerate(bundle.jacobians(free)):
        poses[n] += np.linalg.lstsq(pose, bundle.residuals_px[n].ravel() - own @ change, rcond=None)[0]
    return replace(bundle, lens=lens, poses=poses)


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
        bundle = refine_bundle(bundle, _free(model))
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
    covariance[np.ix_(fit.free, fit.free)] = variance * inverse(normal_equations(fit.bundle, fit.free)[0])
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


def calibration_flags(fit: LensFit, camera: CameraCalibration, sd: LensUncertainty) -> tuple[Flag, ...]:
    """List the reasons not to believe a lens fit, each with its number and what to do.

    Args:
        fit: the fit.
        camera: the same fit as a calibration.
        sd: its standard deviations.
    """
    views, coverage = len(fit.bundle.corners), coverage_of(fit.bundle.corners, camera.width_px, camera.height_px)
    normal = np.array([cv2.Rodrigues(one)[0][:, 2] for one in fit.bundle.poses[:, :3]])  # (v, 3) of the board's plane
    angle = float(np.degrees(np.arccos(np.clip(normal @ normal.T, -1.0, 1.0))).max())
    focal = max(sd.fx_px / camera.fx_px, sd.fy_px / camera.fy_px)
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


# The calibration.


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
