"""The motion of the tail tip, measured or simulated, as the forms of elongated body theory want it.

Derivatives are either the published finite difference between neighbouring frames, which half-pixel tracks inflate
(<h_t^2> by up to 80 % at low speed), or those of a Savitzky-Golay filter (quadratic over 11 frames).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_filter

from fitting.series import bridged, design, weighted_fit
from fitting.speed import whole_beats
from fitting.trial import MeasuredTrial
from swimmer.ebt import TailMotion, TipMotion
from tracking import HeadFrame, from_head_frame

WINDOW, ORDER = 11, 2  # frames and degree of the Savitzky-Golay filter


@dataclass(frozen=True, eq=False)
class TailSwim:
    """What elongated body theory needs of one swim.

    Attributes:
        time_s: (n,) s.
        tip_m: (n, 2, 2) the last two markers in the head frame, relative to the nose, m.
        pool_m: (n, 2, 2) the same two in the pool, m.
        heading_rad: (n,) direction of nose -> neck in the pool, unwrapped.
        weight: (n, 2) 0 leaves a sample out.
        used: (n,) the whole beats looked at.
        frequency_hz: beats a second.
    """

    time_s: np.ndarray
    tip_m: np.ndarray
    pool_m: np.ndarray
    heading_rad: np.ndarray
    weight: np.ndarray
    used: np.ndarray
    frequency_hz: float


def measured_tail(trial: MeasuredTrial, frames: np.ndarray) -> TailSwim:
    """The tail of a measured trial over the whole beats of the frames (n,)."""
    tail = list(trial.tail[-2:])
    return TailSwim(
        time_s=trial.time_s,
        tip_m=trial.head.shape_m[:, tail],
        pool_m=trial.position_m[:, tail],
        heading_rad=trial.head.heading_rad,
        weight=trial.weight[:, tail],
        used=whole_beats(trial.time_s, frames, trial.frequency.hz),
        frequency_hz=trial.frequency.hz,
    )


def simulated_tail(
    time_s: np.ndarray, head: HeadFrame, tail: Sequence[int], frames: np.ndarray, frequency_hz: float
) -> TailSwim:
    """The tail of one simulated swim (n, m, 2); `tail` are the indices of its markers behind the head."""
    last = list(tail[-2:])
    return TailSwim(
        time_s=time_s,
        tip_m=head.shape_m[:, last],
        pool_m=from_head_frame(head)[:, last],
        heading_rad=head.heading_rad,
        weight=np.ones((len(time_s), 2)),
        used=whole_beats(time_s, frames, frequency_hz),
        frequency_hz=frequency_hz,
    )


def published_motion(swim: TailSwim) -> TailMotion:
    """<h_t^2> and <h_x^2> in the head frame, h_t by finite differences, as published."""
    good = (swim.weight > 0) & np.isfinite(swim.tip_m).all(axis=-1) & swim.used[:, None]
    rate = np.diff(swim.tip_m[:, 1, 1]) / np.diff(swim.time_s)  # (n - 1,)
    return _mean_squares(rate, good[1:, 1] & good[:-1, 1], *_slope(swim.tip_m, good))


def smoothed_motion(swim: TailSwim) -> TailMotion:
    """The same with the derivative and the slope of a Savitzky-Golay filter."""
    good = (swim.weight > 0) & np.isfinite(swim.tip_m).all(axis=-1) & swim.used[:, None]
    rate = _smooth(swim.tip_m, swim.time_s, 1)[:, 1, 1]
    return _mean_squares(rate, good[:, 1], *_slope(_smooth(swim.tip_m, swim.time_s, 0), good))


def tip_motion(swim: TailSwim) -> TipMotion:
    """The tip in the frame that swims along: smoothed velocities in the pool, turned by the trend of the heading.

    One sample of nan where the tip is never seen.
    """
    used = swim.used & (swim.weight > 0).all(axis=1) & np.isfinite(swim.pool_m).all(axis=(1, 2))
    if not used.any():
        return TipMotion(*np.full((3, 1), np.nan))
    trend = _heading_trend(swim)
    forward = -np.stack([np.cos(trend), np.sin(trend)], axis=1)  # (n, 2), against nose -> neck
    aside = np.stack([-forward[:, 1], forward[:, 0]], axis=1)
    velocity = _smooth(swim.pool_m, swim.time_s, 1)[:, 1]
    place = _smooth(swim.pool_m, swim.time_s, 0)
    tangent = place[:, 0] - place[:, 1]  # pointing forward
    ahead, lateral = (velocity * forward).sum(axis=1)[used], (velocity * aside).sum(axis=1)[used]
    angle = np.arctan2((tangent * aside).sum(axis=1), (tangent * forward).sum(axis=1))[used]
    return TipMotion(ahead - ahead.mean(), lateral - lateral.mean(), angle - angle.mean())


def _heading_trend(swim: TailSwim) -> np.ndarray:
    """(n,) the heading less its beat: a straight line through the whole beats."""
    columns = design(swim.time_s, swim.frequency_hz, harmonics=2)
    weight = (swim.used & np.isfinite(swim.heading_rad)).astype(float)[:, None]
    return columns[:, :2] @ weighted_fit(columns, swim.heading_rad[:, None], weight)[:2, 0]


def _smooth(series_m: np.ndarray, time_s: np.ndarray, derivative: int) -> np.ndarray:
    """(n, 2, 2) smoothed series or its time derivative; missing samples are bridged before."""
    flat = bridged(time_s, series_m.reshape(len(series_m), -1))
    window = min(WINDOW, len(flat) - 1 + len(flat) % 2)
    step = float(np.median(np.diff(time_s)))
    smooth = savgol_filter(flat, window, min(ORDER, window - 1), deriv=derivative, delta=step, axis=0)
    return smooth.reshape(series_m.shape)


def _slope(tip_m: np.ndarray, good: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n,) slope of the line through the last two markers, and where it counts."""
    step = tip_m[:, 1] - tip_m[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        return step[:, 1] / step[:, 0], good.all(axis=1) & (np.abs(step[:, 0]) > 1e-6)


def _mean_squares(rate: np.ndarray, rate_good: np.ndarray, slope: np.ndarray, slope_good: np.ndarray) -> TailMotion:
    def mean_square(values: np.ndarray) -> np.ndarray:
        return np.array((values**2).mean() if len(values) else np.nan)

    return TailMotion(mean_square(rate[rate_good]), mean_square(slope[slope_good]))
