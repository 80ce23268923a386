"""Finding the inner corners of a board in a picture."""

from typing import NamedTuple

import cv2
import numpy as np

from tracking.lens.board import BoardSpec

CLEAR_SHARE = 0.7
"""Half width of the window in which a corner is refined, over its distance to the nearest edge that is not its own:
that of a marker, or of the next square. Windows that reach such an edge move corners by whole pixels."""
WINDOW_PX = (3, 12)
"""Bounds of that half width: less holds too few pixels, more gains nothing and bends with the lens."""

SEARCHED_PX = 1600
"""Longest side of the picture that a chessboard is searched in: larger ones take ten seconds, and are full of false
boards. The corners are then refined in the whole picture."""


class Corners(NamedTuple):
    """Corners of one board in one picture."""

    place_m: np.ndarray  # (k, 3) on the board, board frame, z = 0
    image_px: np.ndarray  # (k, 2) in the picture, the centre of the top left pixel at (0, 0)


def find_corners(picture: np.ndarray, board: BoardSpec) -> Corners:
    """Find the visible corners of the board in a picture; none (k = 0) where there is no board.

    A chessboard is found whole or not at all; which of its ends comes first is arbitrary where both look the same.
    Chessboards: Duda and Frese, "Accurate Detection and Localization of Checkerboard Corners", BMVC 2018.

    Args:
        picture: (h, w) or (h, w, 3) uint8.
        board: the board.
    """
    gray = np.ascontiguousarray(picture) if picture.ndim == 2 else cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
    return _charuco_corners(gray, board) if board.kind == "charuco" else _chessboard_corners(gray, board)


def _charuco_corners(gray: np.ndarray, board: BoardSpec) -> Corners:
    found, ids, _, _ = cv2.aruco.CharucoDetector(board.charuco).detectBoard(gray)
    if found is None or len(found) == 0:
        return _NONE
    clear = (board.square_m - board.marker_side_m) / 2 / board.square_m
    return Corners(board.corner_places_m[np.ravel(ids)], _refine(gray, found.reshape(-1, 2), clear))


def _chessboard_corners(gray: np.ndarray, board: BoardSpec) -> Corners:
    size = (board.columns - 1, board.rows - 1)
    shrink = -(-max(gray.shape) // SEARCHED_PX)
    small = cv2.resize(gray, None, fx=1 / shrink, fy=1 / shrink, interpolation=cv2.INTER_AREA)
    seen, found = cv2.findChessboardCornersSB(small, size, flags=cv2.CALIB_CB_NORMALIZE_IMAGE)
    if not seen:
        return _NONE
    image_px = shrink * (found.reshape(-1, 2) + 0.5) - 0.5
    return Corners(board.corner_places_m, _refine(gray, image_px, clear=0.5))


def _refine(gray: np.ndarray, image_px: np.ndarray, clear: float) -> np.ndarray:
    """Move the corners (k, 2) to the saddle points of the picture.

    Detectors place them by homographies or along straight lines, and miss them where the lens bends.

    Args:
        gray: (h, w) picture.
        image_px: (k, 2) corners, px.
        clear: distance to the nearest edge that is not the corner's own, in squares.
    """
    distance = np.linalg.norm(image_px[:, None] - image_px[None], axis=2) + np.diag(np.full(len(image_px), np.inf))
    square_px = distance.min() if len(image_px) > 1 else 0.0
    window = int(np.clip(CLEAR_SHARE * clear * square_px, *WINDOW_PX))
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 50, 1e-3)
    start = np.array(image_px, dtype=np.float32).reshape(-1, 1, 2)
    return cv2.cornerSubPix(gray, start, (window, window), (-1, -1), stop).reshape(-1, 2).astype(float)


_NONE = Corners(np.zeros((0, 3)), np.zeros((0, 2)))
