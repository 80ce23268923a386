"""Times that were rounded when they were written, made even again where that is certain."""

from __future__ import annotations

import numpy as np

from session import FaultCollector

COARSE = 0.25
"""Share of a frame beyond which rounded times no longer give the distance of single frames."""
SPAN = 60
"""Frames over which the frame rate is first measured."""


def even_times(time_s: np.ndarray, fps: float | None, faults: FaultCollector) -> np.ndarray:
    """Return the frame times (n,), made even where they are coarsely rounded times of an even clock.

    Frames that are left out stay out.

    Args:
        time_s: (n,) times, s.
        fps: the frame rate, where it is known.
        faults: takes the faults.

    Raises:
        InputError: coarse times that are those of no even clock, and no `fps`, with the faults that were there before.
    """
    step_s, rounded_s = float(np.median(np.diff(time_s))), _rounding(time_s)
    if rounded_s < COARSE * step_s:
        return time_s
    since_s = time_s - time_s[0]
    span = min(SPAN, len(time_s) - 1)
    rates = (len(time_s) - 1) / since_s[-1], float(span / np.median(since_s[span:] - since_s[:-span]))
    for rate in (*rates, *((fps,) if fps else ())):  # at a wrong rate, frames would seem to be left out
        frame = np.rint(since_s * rate)
        off_s = float(np.abs(since_s - frame / rate).max())
        if (np.diff(frame) < 1).any() or off_s > 1.01 * rounded_s:
            continue
        if off_s < 1e-3 * step_s:  # even as they are
            return time_s
        if rate != fps:
            rate = float((frame @ frame) / (frame @ since_s))
        return np.asarray(time_s[0] + frame / rate)
    if fps is not None:
        return time_s
    found = f"steps of {np.diff(time_s).min():.4g} to {np.diff(time_s).max():.4g} s, rounded to {rounded_s:g} s"
    expected, step = "an even clock, or finer times", "Give the frame rate of the camera: add `--fps 60`."
    faults.add("", "the times are too coarse to tell the frame rate", found=found, expected=expected, next_step=step)
    faults.raise_if_any()
    raise AssertionError("unreachable")


def _rounding(time_s: np.ndarray) -> float:
    """Return the power of ten that all times are multiples of, s; 0 where they are finer than microseconds."""
    for digits in range(7):
        scaled = (time_s - np.floor(time_s[0])) * 10**digits
        if np.abs(scaled - np.rint(scaled)).max() < 1e-6 * 10 ** max(digits - 3, 0):
            return float(10.0**-digits)
    return 0.0
