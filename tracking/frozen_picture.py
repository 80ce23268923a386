"""Stretches in which no marker moves at all: a paused or duplicated video, not a still robot."""

import numpy as np

from session import Flag


def frozen_picture(position_px: np.ndarray, frames: int, motion_px: float) -> np.ndarray:
    """(n,) frames within a stretch of at least `frames` frames whose markers (n, m, 2) all stay where they are.

    A robot that comes to rest slows down; a picture that freezes does so from one frame to the next: just before or
    after the stretch some marker moves by at least `motion_px` in a frame. The first frame of a stretch is a true
    picture and stays out. A marker that is missing counts as unmoved.
    """
    step = np.nan_to_num(np.abs(np.diff(position_px, axis=0)))
    moved_px = step.max(axis=(1, 2), initial=0.0)  # (n - 1,)
    seen = np.isfinite(position_px).all(axis=2).any(axis=1)  # (n,)
    same = np.concatenate([[False], (step == 0).all(axis=(1, 2)) & seen[1:]])
    result = np.zeros(len(same), bool)
    for first, last in stretches(same):
        around = np.concatenate([moved_px[max(first - 3, 0) : first - 1], moved_px[last : last + 2]])
        abrupt = around.max(initial=0.0) >= motion_px
        result[first : last + 1] = abrupt and last - first + 2 >= frames
    return result


def stretches(mask: np.ndarray) -> list[tuple[int, int]]:
    """First and last index, both included, of each run of True in (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(int), [0]])))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def frozen_flags(frozen: np.ndarray, markers: tuple[str, ...]) -> list[Flag]:
    """A flag for each stretch."""
    return [
        Flag(
            "frozen_marker",
            markers,
            (first, last),
            f"no marker moves for {last - first + 1} frames: the video stands still or repeats itself",
        )
        for first, last in stretches(frozen)
    ]
