"""Runs of frames."""

import numpy as np


def stretches(mask: np.ndarray, least: int = 1) -> list[tuple[int, int]]:
    """First and last frame, both included, of each run of at least so many True in (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    return [(int(first), int(last) - 1) for first, last in edges.reshape(-1, 2) if last - first >= least]
