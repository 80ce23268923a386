"""Samples that are suspect on sight: two boxes on one spot, a box that stands still while the body moves."""

import numpy as np


def stretches(mask: np.ndarray) -> list[tuple[int, int]]:
    """First and last frame, both included, of each run of True in (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    return [(int(first), int(last) - 1) for first, last in edges.reshape(-1, 2)]


def touching(position_px: np.ndarray, least_px: np.ndarray) -> np.ndarray:
    """(n, m, m) whether two markers are closer than (m, m) `least_px`; a marker never touches itself."""
    between = np.linalg.norm(position_px[:, :, None] - position_px[:, None], axis=-1)  # (n, m, m)
    return (between < least_px) & ~np.eye(position_px.shape[1], dtype=bool)


def standing_still(
    position_px: np.ndarray, order: np.ndarray, frames: int, still_px: float, motion_px: float
) -> np.ndarray:
    """(n, m) whether a marker stands still while its two nearest in body order both move.

    Args:
        position_px: (n, m, 2).
        order: (m,) the markers in the order of the body.
        frames: the shortest stretch.
        still_px: how much it may move over any `frames` frames, in each coordinate.
        motion_px: how much the neighbours move at least over the stretch, and four times the marker.
    """
    n, m, _ = position_px.shape
    still = np.zeros((n, m), dtype=bool)
    if n < frames or m < 3:
        return still
    windows = np.lib.stride_tricks.sliding_window_view(position_px, frames, axis=0)  # (…, m, 2, frames)
    quiet = (np.ptp(windows, axis=-1) <= still_px).all(axis=-1)  # (n - frames + 1, m)
    rank = np.argsort(order)
    for k in range(m):
        nearest = np.argsort(np.abs(rank - rank[k]), kind="stable")[:3]  # itself first
        for first, last in stretches(quiet[:, k]):
            span = slice(first, last + frames)
            own, *others = np.linalg.norm(np.ptp(position_px[span][:, nearest], axis=0), axis=1)
            if min(others) >= max(motion_px, 4 * own):  # False where a sample is missing
                still[span, k] = True
    return still
