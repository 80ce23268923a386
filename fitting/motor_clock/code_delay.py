"""The exact moment of one code in a video, with a standard error that allows for tracking errors that last.

All markers have equal weight. Weights by the covariance of their errors, mostly those of nose and neck, would be
four times as exact in air; in water the markers lag each by another time, and it then trusts the wrong differences.
"""

from typing import NamedTuple

import numpy as np

from fitting.free_decay.lasting_noise import LastingNoise, LinearModel, descend, regress
from fitting.motor_clock.tail_motion import TailMotion
from swimmer import CrankTurn

FARTHEST_S = 0.06  # from where both codes together were found; beyond, the tail hardly moved in this one
COMPLETE = 0.8  # share of the code's frames that a marker must be seen in to count
_STEPS, _STEP_S = 5, 0.03
_START_NOISE = LastingNoise(duration_s=0.1, white_share=0.3, sd_m=1e-3)
_MAP = 4  # numbers a marker: constant, drift, cosine, sine


class CodeDelay(NamedTuple):
    """One code, seen.

    Attributes:
        offset_s: motor clock minus video clock in the middle of the code.
        se_s: its standard error.
        middle_s: of the code, on the clock of the video.
        explained: share of the tail's motion that the crank's explains, 0 to 1.
    """

    offset_s: float
    se_s: float
    middle_s: float
    explained: float


def code_delay(tail: TailMotion, turn: CrankTurn, code: tuple[float, float], offset_s: float) -> CodeDelay | None:
    """Refines the moment of a code; None where the code is not in the video, or the refinement leaves it.

    Every marker has a constant, a drift, and a linear map of cosine and sine of the crank's angle of its own; all
    share the offset.

    Args:
        tail: n frames.
        turn: of the crank, on the motor's clock.
        code: first and last instant, on that clock, s.
        offset_s: motor clock minus video clock, to a few frames.
    """
    begins_s, ends_s = code[0] - offset_s, code[1] - offset_s
    if begins_s < tail.time_s[0] - tail.frame_s or ends_s > tail.time_s[-1] + tail.frame_s:
        return None
    frames = np.flatnonzero((tail.time_s >= begins_s) & (tail.time_s < ends_s))
    seen = tail.used[frames].mean(axis=0) >= COMPLETE  # (k,)
    frames = frames[tail.used[np.ix_(frames, seen)].all(axis=1)] if seen.any() else frames[:0]
    if len(frames) < COMPLETE / 2 * (ends_s - begins_s) / tail.frame_s:
        return None
    time_s, lateral = tail.time_s[frames], tail.lateral_m[np.ix_(frames, seen)]
    found, noise = offset_s, _START_NOISE
    for step in range(_STEPS):
        model = _linearised(time_s, lateral, turn, found)
        result = descend(model, noise) if step < _STEPS - 1 else regress(model)
        found += float(np.clip(result.step[0], -_STEP_S, _STEP_S))
    if abs(found - offset_s) > FARTHEST_S:
        return None
    columns = _crank(time_s, turn, found)[0]
    residual, total = _residual(columns, lateral), _residual(columns[:, :2], lateral)
    markers = int(seen.sum())
    few = np.sqrt(markers / (markers - 1)) if markers > 1 else 1.0  # CR1; Cameron and Miller 2015
    return CodeDelay(
        offset_s=found,
        se_s=float(few * np.sqrt(result.covariance[0, 0])),
        middle_s=sum(code) / 2 - found,
        explained=1 - float((residual**2).sum() / max(float((total**2).sum()), 1e-30)),
    )


def _crank(time_s: np.ndarray, turn: CrankTurn, offset_s: float) -> tuple[np.ndarray, np.ndarray]:
    """(n, 4) regressors of every marker, and how they change with the offset."""
    angle, speed = turn.angle(time_s + offset_s), turn.speed(time_s + offset_s)
    none = np.zeros_like(time_s)
    columns = [none + 1, time_s - time_s.mean(), np.cos(angle), np.sin(angle)]
    return np.stack(columns, axis=1), np.stack([none, none, -np.sin(angle) * speed, np.cos(angle) * speed], axis=1)


def _residual(columns: np.ndarray, series: np.ndarray) -> np.ndarray:
    return series - columns @ np.linalg.lstsq(columns, series, rcond=None)[0]


def _linearised(time_s: np.ndarray, lateral_m: np.ndarray, turn: CrankTurn, offset_s: float) -> LinearModel:
    """The best maps for this offset; how the motion changes with the offset (first) and with the maps."""
    columns, slopes = _crank(time_s, turn, offset_s)
    maps = np.linalg.lstsq(columns, lateral_m, rcond=None)[0]  # (4, k)
    markers = lateral_m.shape[1]
    jacobian = np.zeros((*lateral_m.shape, 1 + _MAP * markers))
    jacobian[..., 0] = slopes @ maps
    for k in range(markers):
        jacobian[:, k, 1 + _MAP * k : 1 + _MAP * (k + 1)] = columns
    none = np.zeros(1 + _MAP * markers)
    used = np.ones(lateral_m.shape, bool)
    return LinearModel(time_s, used, lateral_m - columns @ maps, jacobian, none, none)
