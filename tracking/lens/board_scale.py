"""The scale of a picture from a board that lies level in the pool: an alternative to the nose-neck distance."""

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from scipy.optimize import brentq

from session import NotEnoughData
from session.camera import CameraCalibration
from tracking.lens.board import BoardSpec
from tracking.lens.corners import Corners, find_corners
from tracking.lens.parallax import true_over_apparent
from tracking.lens.pictures import read_picture
from tracking.lens.undistort import camera_matrix, to_rays

HIGHEST_M = 100.0
"""Largest height of a camera above a pool."""


@dataclass(frozen=True)
class BoardScale:
    """Scale, height and tilt of the camera, as a level board in the picture shows them."""

    # Scale on the surface of the water, in undistorted square pixels (of focal length fx where the lens is calibrated),
    # as `to_pool` has it.
    metres_per_px: float
    # Its standard deviation follows from the scatter of the corners about a level board; without a lens it holds
    # distortion and tilt too, as far as the board shows them.
    sd_metres_per_px: float
    camera_height_m: float | None  # height of the lens above the water; None without a calibrated lens
    # Angle between the camera's axis and the board's normal; None without a calibrated lens. A tilt of 2 degrees
    # changes the scale by 2 % from the middle to the edge of a picture 60 degrees wide.
    tilt_deg: float | None
    rms_px: float  # distance of the corners from a level board


def scale_from_board(
    picture: Path | np.ndarray, board: BoardSpec, lens: CameraCalibration | None = None, board_height_m: float = 0.0
) -> BoardScale:
    """Return the scale at the water's surface, and the camera's height above it where the lens is calibrated.

    Args:
        picture: file or (h, w) or (h, w, 3) uint8.
        board: the board as printed and measured, lying level.
        lens: calibration of the camera; without it the picture is taken to be undistorted.
        board_height_m: height of the board's face above the water; negative under water (refraction is undone).

    Raises:
        InputError: the picture cannot be read.
        NotEnoughData: no board is found, or it lies off the surface and the lens is not calibrated.
    """
    seen = find_corners(read_picture(picture) if isinstance(picture, Path) else picture, board)
    return scale_from_corners(seen, lens, board_height_m)


def scale_from_corners(seen: Corners, lens: CameraCalibration | None = None, board_height_m: float = 0.0) -> BoardScale:
    """Return the scale for corners that are found already; see `scale_from_board`.

    Args:
        seen: the k corners of the board.
        lens: calibration of the camera; without it the picture is taken to be undistorted.
        board_height_m: height of the board's face above the water; negative under water.

    Raises:
        NotEnoughData: fewer than four corners, or a board off the surface and no lens.
    """
    if lens is None and board_height_m != 0.0:
        raise NotEnoughData(
            f"the board lies {board_height_m:g} m above the water, so its scale is not the water's; calibrate "
            "the lens, or lay the board at the surface"
        )
    if len(seen.image_px) < 4:
        raise NotEnoughData(
            f"{len(seen.image_px)} corners of the board were found; at least 4 are needed. Are its kind and "
            "its numbers of squares right, and is it whole in the picture?"
        )
    if lens is None:
        fit = _similarity(seen.image_px, seen.place_m[:, :2])
        return BoardScale(fit.scale, fit.sd_scale, None, None, fit.rms / fit.scale)
    return _with_lens(seen, lens, board_height_m)


def _with_lens(seen: Corners, lens: CameraCalibration, board_height_m: float) -> BoardScale:
    ray, place = to_rays(seen.image_px, lens), seen.place_m[:, :2]

    def fit_at(camera_height_m: float) -> _Similarity:
        factor = true_over_apparent(ray, np.array(board_height_m), camera_height_m)[:, None]
        return _similarity(camera_height_m * factor * ray, place)

    lowest = max(board_height_m, 0.0) + 1e-6
    if not fit_at(lowest).scale > 1 > fit_at(HIGHEST_M).scale:
        raise NotEnoughData(
            f"no height of the camera between {lowest:.2g} and {HIGHEST_M:g} m gives the board its size; check "
            "square_m, the height of the board, and that the lens was calibrated for this picture"
        )
    height = float(brentq(lambda h: fit_at(h).scale - 1.0, lowest, HIGHEST_M, xtol=1e-9))
    fit = fit_at(height)
    metres_per_px = height / lens.fx_px
    return BoardScale(
        metres_per_px=metres_per_px,
        sd_metres_per_px=metres_per_px * fit.sd_scale,
        camera_height_m=height,
        tilt_deg=_tilt_deg(seen, lens),
        rms_px=fit.rms / metres_per_px,
    )


def _tilt_deg(seen: Corners, lens: CameraCalibration) -> float:
    """Return the angle between the camera's axis and the normal of the board; refraction is neglected."""
    _, rotation, _ = cv2.solvePnP(
        seen.place_m, seen.image_px, camera_matrix(lens), np.array(lens.distortion), flags=cv2.SOLVEPNP_IPPE
    )
    return float(np.degrees(np.arccos(min(1.0, abs(cv2.Rodrigues(rotation)[0][2, 2])))))


class _Similarity(NamedTuple):
    """Best similarity transform: scale (target over source), its standard deviation, RMS distance in target units."""

    scale: float
    sd_scale: float
    rms: float


def _similarity(source: np.ndarray, target: np.ndarray) -> _Similarity:
    """Fit the move, turn and scale that take (k, 2) to (k, 2) best (Umeyama, IEEE PAMI 13, 1991, in the plane)."""
    a = (source - source.mean(axis=0)) @ [1, 1j]
    b = (target - target.mean(axis=0)) @ [1, 1j]
    size = (np.abs(a) ** 2).sum()
    turn = (np.conj(a) * b).sum() / size
    squares = (np.abs(b - turn * a) ** 2).sum()
    variance = squares / max(2 * len(a) - 4, 1)  # per axis
    return _Similarity(float(np.abs(turn)), float(np.sqrt(variance / size)), float(np.sqrt(squares / len(a))))
