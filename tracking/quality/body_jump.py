"""Jumps of the whole body: a bumped camera, spliced clips, frames that are gone without a trace in the time stamps.

No single marker gives it away, since all of them jump together and keep the body's shape. Smooth motion does: the step
between two frames is about the mean of the steps before and after it (the difference is of third order in time). A few
missing frames change less than that; they show where the motion is smooth again once their time is put between.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from session import Flag

LEAST_PX = 6.0
"""Half of the markers or more are off the smooth motion by this, …"""
LEAST_LENGTH = 0.01
"""… and by this share of the body's length in the picture, …"""
TIMES_USUAL = 4.0
"""… and by so many times what is usual in the trial, noise and hard beats included."""
AROUND, STANDS_OUT = 10, 2.0
"""No step of so many frames before and after is half as large, or the robot was shaken."""
LONG_STEP = 2.5
"""A time step this many times the usual one is a gap that the stamps tell of."""
FEWEST_MARKERS = 3
EVEN = 0.25
"""Time steps that differ from the usual one by less than this share of it are even."""
MOST_MISSING = 12
"""Frames that are looked for between two; more are a jump."""
BESIDE, DEGREE = 5, 4
"""Frames on either side through which smooth motion is laid, and the degree of its polynomial in time."""
BETTER = 0.5
"""Frames are missing where the motion is off by this share, at most, of what it is off without them, …"""
STANDS_OUT_MISSING, LEAST_OFF_PX = 2.5, 0.3
"""… and without them by so many times what is usual in the trial, and by so many px, rms."""


def body_jumps(time_s: np.ndarray, position_px: np.ndarray) -> list[tuple[int, float]]:
    """The frames to which the whole body of markers (n, m, 2) jumps, with how far it is off its motion, px.

    `time_s` (n,) are the times of the frames, s.
    """
    if len(time_s) < 8 or position_px.shape[1] < FEWEST_MARKERS:
        return []
    off = _off_motion_px(time_s, position_px)  # (n,)
    known = off[np.isfinite(off)]
    if not len(known):
        return []
    whole = position_px[np.isfinite(position_px).all(axis=(1, 2))]
    body_px = float(np.median(np.hypot(*np.ptp(whole, axis=1).T))) if len(whole) else 0.0
    least = max(LEAST_PX, LEAST_LENGTH * body_px, TIMES_USUAL * float(np.quantile(known, 0.9)))
    far = np.nan_to_num(off) > least
    peaks = [k for k in np.flatnonzero(far).tolist() if off[k] >= np.nanmax(off[max(k - 2, 0) : k + 3])]
    jumps = {k for k in peaks if off[k] > STANDS_OUT * _largest_around_px(position_px, k)}
    jumps.update(np.flatnonzero(_follows_missing(time_s, position_px)).tolist())
    return [(k, float(np.nan_to_num(off[k]))) for k in sorted(jumps)]


def _follows_missing(time_s: np.ndarray, position_px: np.ndarray) -> np.ndarray:
    """(n,) bool, the frames before which others are missing: as much later, the motion would go on smoothly."""
    found, count = np.zeros(len(time_s), bool), len(time_s) - 2 * BESIDE + 1
    if count < 1:
        return found
    parts = np.lib.stride_tricks.sliding_window_view(position_px, 2 * BESIDE, axis=0)  # (k, m, 2, 10)
    seen = np.isfinite(parts).all(axis=(2, 3))
    step_s = np.diff(time_s)
    even = np.abs(step_s / np.median(step_s) - 1) < EVEN
    good = np.lib.stride_tricks.sliding_window_view(even, 2 * BESIDE - 1).all(axis=1)
    good &= seen.sum(axis=1) >= max(FEWEST_MARKERS, (position_px.shape[1] + 1) // 2)
    if not good.any():
        return found
    moment = np.arange(2 * BESIDE) - BESIDE
    off = np.full((MOST_MISSING + 1, count), np.nan)  # px, of the median marker
    for missing in range(MOST_MISSING + 1):
        basis = np.linalg.qr(np.vander((moment + missing * (moment >= 0)).astype(float), DEGREE + 1))[0]
        left = parts[good] - (parts[good] @ basis) @ basis.T
        off[missing, good] = np.nanmedian(np.sqrt((left**2).sum(axis=(2, 3))), axis=1)
    usual = float(np.median(off[:, good].min(axis=0)))
    least = max(LEAST_OFF_PX, STANDS_OUT_MISSING * usual)
    off = np.nan_to_num(off)
    worse = good & (off[0] > least) & (off[1:].min(axis=0) < BETTER * off[0])
    around = np.pad(off[0], BESIDE)
    worse &= off[0] >= np.lib.stride_tricks.sliding_window_view(around, 2 * BESIDE + 1).max(axis=1)
    found[BESIDE : BESIDE + count] = worse
    return found


def _largest_around_px(position_px: np.ndarray, frame: int) -> float:
    """The largest step of the median marker near a frame, but for the one to it, px."""
    first = max(frame - 1 - AROUND, 0)
    near = np.linalg.norm(np.diff(position_px[first : frame + AROUND + 1], axis=0), axis=2)  # (k, m)
    seen = np.isfinite(near).any(axis=1)
    seen[frame - 1 - first] = False
    return float(np.nanmedian(near[seen], axis=1).max(initial=0.0))


def _off_motion_px(time_s: np.ndarray, position_px: np.ndarray) -> np.ndarray:
    """(n,) how far the step to each frame is off the mean of those around it, the median marker; nan where unknown."""
    step_s = np.diff(time_s)
    velocity = np.diff(position_px, axis=0) / step_s[:, None, None]  # (n - 1, m, 2)
    around = 0.5 * (velocity[:-2] + velocity[2:])
    apart = np.linalg.norm(velocity[1:-1] - around, axis=2) * step_s[1:-1, None]  # (n - 3, m)
    seen = np.isfinite(apart)
    enough = seen.sum(axis=1) >= max(FEWEST_MARKERS, (position_px.shape[1] + 1) // 2)
    usual_s = float(np.median(step_s))
    steady = (np.stack([step_s[:-2], step_s[1:-1], step_s[2:]]) < LONG_STEP * usual_s).all(axis=0)
    off = np.full(len(time_s), np.nan)
    good = enough & steady
    off[2:-1][good] = np.nanmedian(apart[good], axis=1)
    return off


def longest_part(frames: int, jumps: list[int]) -> slice:
    """Return the longest part between jumps: what is compared of a trial goes on without a break."""
    edges = [0, *jumps, frames]
    first, last = max(pairwise(edges), key=lambda part: part[1] - part[0])
    return slice(first, last)


def jump_flags(jumps: list[tuple[int, float]], part: slice, markers: tuple[str, ...]) -> list[Flag]:
    """A flag for each jump of the whole body."""
    return [
        Flag(
            "jump",
            markers,
            (frame, frame),
            f"the whole body jumps by {off_px:.0f} px between frames {frame - 1} and {frame}: the camera was moved, or "
            f"frames are missing; only frames {part.start} to {part.stop - 1} count",
        )
        for frame, off_px in jumps
    ]
