"""Where in a video a motor's codes are: the tail's motion against that of the logged crank, at every offset.

The tail's place is a smooth function of the crank's angle, and the code spans a fifth of a turn of it. Over the code a
marker's lateral place is therefore close to a + b cos(angle) + c sin(angle), whatever the crank's zero and the robot.
"""

from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from fitting.motor_clock.tail_motion import TailMotion
from swimmer import CrankTurn

APART_S = 0.25  # of two offsets that count as different: one chip of the code
_STILL_M = 1e-5


class Found(NamedTuple):
    """The offset at which the codes fit best.

    Attributes:
        offset_s: motor clock minus video clock, to a frame.
        gain: how well they fit: minus the sum of log(1 - explained share) over the codes in the video.
        next_gain: of the best other offset.
    """

    offset_s: float
    gain: float
    next_gain: float


def search(tail: TailMotion, turn: CrankTurn, codes: list[tuple[float, float]]) -> Found | None:
    """Tries every offset at which at least one of the codes is in the video; None where none can be.

    Args:
        tail: n frames.
        turn: of the crank, on the motor's clock.
        codes: first and last instant of each code on that clock, s.
    """
    motion, frame_s = tail.evenly(), tail.frame_s
    first = [_first_frames(tail, code, motion) for code in codes]
    if not any(len(offsets) for offsets in first):
        return None
    low, high = (f([f(offsets) for offsets in first if len(offsets)]) for f in (np.min, np.max))
    grid = np.arange(low, high + frame_s / 2, frame_s)
    gain = np.zeros(len(grid))
    for code, offsets in zip(codes, first, strict=True):
        if len(offsets):
            share = explained(motion, frame_s, turn, code)
            gain += np.interp(grid, offsets[::-1], -np.log1p(-share)[::-1], left=0.0, right=0.0)
    best = int(np.argmax(gain))
    others = gain[np.abs(grid - grid[best]) > APART_S]
    return Found(float(grid[best]), float(gain[best]), float(others.max(initial=0.0)))


def explained(motion_m: np.ndarray, frame_s: float, turn: CrankTurn, code: tuple[float, float]) -> np.ndarray:
    """(w,) share of the tail's motion that the crank's explains where the code begins at each of w frames.

    Args:
        motion_m: (f, k) of the tail, evenly spaced.
        frame_s: their spacing, s.
        turn: of the crank.
        code: first and last instant, on the clock of `turn`, s.
    """
    length = _frames(code, frame_s)
    angle = turn.angle(code[0] + frame_s * np.arange(length))
    steady = np.linalg.qr(np.stack([np.ones(length), np.arange(length)], axis=1))[0]  # (l, 2)
    moving = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    moving = np.linalg.qr(moving - steady @ (steady.T @ moving))[0]
    windows = sliding_window_view(motion_m, length, axis=0)  # (w, k, l)
    windows = windows - windows.mean(axis=2, keepdims=True)
    total = (windows**2).sum(axis=(1, 2)) - ((windows @ steady) ** 2).sum(axis=(1, 2))
    by_crank = ((windows @ moving) ** 2).sum(axis=(1, 2))
    return np.clip(by_crank / (np.maximum(total, 0.0) + motion_m.shape[1] * length * _STILL_M**2), 0.0, 1 - 1e-9)


def _frames(code: tuple[float, float], frame_s: float) -> int:
    return round((code[1] - code[0]) / frame_s)


def _first_frames(tail: TailMotion, code: tuple[float, float], motion_m: np.ndarray) -> np.ndarray:
    """(w,) falling offsets at which the code begins at one frame after the other and still ends in the video, s."""
    places = len(motion_m) - _frames(code, tail.frame_s) + 1 if motion_m.shape[1] else 0
    return code[0] - tail.time_s[0] - tail.frame_s * np.arange(max(places, 0))
