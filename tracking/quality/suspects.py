"""Samples that are suspect on sight: two boxes on one spot, a box that stands still while the body moves."""

import numpy as np

from tracking.stretches import stretches

STILL_FRAMES = 5
"""A box is frozen if it stands still for at least this many frames …"""
STILL_PX = 1.0
"""… moving by no more than this over so many frames, in each coordinate …"""
STILL_MOTION_PX = 6.0
"""… while both its neighbours move by at least this, and four times as much as it, and leave it behind by as much."""


def touching(position_px: np.ndarray, least_px: np.ndarray) -> np.ndarray:
    """(n, m, m) whether two markers are closer than (m, m) `least_px`; a marker never touches itself."""
    between = np.linalg.norm(position_px[:, :, None] - position_px[:, None], axis=-1)  # (n, m, m)
    return (between < least_px) & ~np.eye(position_px.shape[1], dtype=bool)


def standing_still(position_px: np.ndarray, order: np.ndarray) -> np.ndarray:
    """(n, m) whether a marker at (n, m, 2) stands still while its two nearest in body order (m,) both move."""
    n, m, _ = position_px.shape
    still = np.zeros((n, m), dtype=bool)
    if n < STILL_FRAMES or m < 3:
        return still
    windows = np.lib.stride_tricks.sliding_window_view(position_px, STILL_FRAMES, axis=0)  # (…, m, 2, f)
    quiet = (np.ptp(windows, axis=-1) <= STILL_PX).all(axis=-1)  # (n - f + 1, m)
    rank = np.argsort(order)
    for k in range(m):
        nearest = np.argsort(np.abs(rank - rank[k]), kind="stable")[:3]  # itself first
        for first, last in stretches(quiet[:, k]):
            span = slice(first, last + STILL_FRAMES)
            own, *others = np.linalg.norm(np.ptp(position_px[span][:, nearest], axis=0), axis=1)
            if min(others) >= max(STILL_MOTION_PX, 4 * own):  # False where a sample is missing
                still[span, k] = True
    return still
