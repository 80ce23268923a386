"""Lens calibration from pictures of a board: the lens, how good it is, and which pictures it rests on."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from session import Flag, NotEnoughData
from session.camera import CameraCalibration
from tracking.lens.board import BoardSpec
from tracking.lens.corners import Corners, find_corners
from tracking.lens.credibility import RMS_SHARE, LensUncertainty, calibration_flags, coverage_of, lens_uncertainty
from tracking.lens.lens_fit import LensFit, fit_lens
from tracking.lens.pictures import each_picture

LEAST_CORNERS = 8
"""Least number of corners: fewer determine little more than the pose of the board."""
LEAST_VIEWS = 3
"""Least number of views: each gives two equations for the camera's four numbers or more (Zhang 2000, section 3.1)."""
OUTLYING_VIEW = 3.0
"""A view is left out whose corners are off by this many times the usual."""
OUTLYING_PX = 0.3
"""A view whose corners are off by less than this is never left out."""


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
    calibration = _as_camera(fit, *size)
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


def _as_camera(fit: LensFit, width_px: int, height_px: int) -> CameraCalibration:
    fx, fy, cx, cy, k1, k2, p1, p2, k3 = fit.bundle.lens.tolist()
    pinhole = {"fx_px": fx, "fy_px": fy, "cx_px": cx, "cy_px": cy}
    return CameraCalibration(width_px=width_px, height_px=height_px, **pinhole, distortion=(k1, k2, p1, p2, k3))
