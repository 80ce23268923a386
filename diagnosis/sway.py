"""Motion beside the beat: what moves the whole fish in no step with the crank, which no twin does.

Gaits hold what repeats with the crank; what does not would pass for tracking noise. But a tracker errs at each marker
by itself, and waves, eddies, a tether or a camera that shakes move all markers together. So what drift and harmonics
leave of the markers, but for how a swim settles and for a beat that comes early or late, is split over short stretches
of time into a motion of the whole (along, across, turning) and the rest, which tells the noise. Under noise alone both
have the same variance (analysis of variance; Fisher 1925).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp

from fitting.posterior.gait import Gait
from fitting.posterior.noise import smooth_swim
from fitting.trial import MeasuredTrial

_STRETCH_S = 0.25  # longer than trackers err alike
_LASTING = 0.5  # of all stretches, as many as count for independent: trackers err alike for a little longer yet
_RATIOS = np.geomspace(10.0, 4000.0, 10)  # of the variance of the whole's motion to that of noise, where there is one
_WANDERS_S = 0.5  # in which a beat comes earlier or later
_SETTLES_S = (0.3, 1.0)  # in which a fish that has just started comes up to its speed
_WHOLE = 3  # along, across, turning
_MOSTLY = 0.8  # of the frames, in which a marker must count
_LEAST_M = 1e-4  # noise of a marker, below which none is believed
_ROUNDS = 3  # in which each marker's own noise is found


class Sway(NamedTuple):
    """Of all trials of a session.

    Attributes:
        rms_m: of the motion of the whole beside its beat, mean over markers, noise taken out, m.
        log_odds: by which the tracks speak for such a motion and against noise alone (log Bayes factor).
    """

    rms_m: float
    log_odds: float


class _Squares(NamedTuple):
    """Mean squares in units of each marker's noise: of the whole's motion and of the rest, and numbers of either."""

    whole: float
    rest: float
    whole_count: float
    rest_count: float
    rms_m: float


def sway_of(trials: Sequence[MeasuredTrial]) -> Sway:
    """What moves the fish in these trials beside its beat; nothing where no trial tells."""
    told = [each for each in map(_squares, trials) if each is not None]
    if not told:
        return Sway(0.0, 0.0)
    whole, rest = (sum(getattr(each, name) for each in told) for name in ("whole_count", "rest_count"))
    ratio = sum(each.whole / each.rest * each.whole_count for each in told) / whole
    rms_m = float(np.sqrt(np.mean([each.rms_m**2 for each in told])))
    return Sway(rms_m, _log_odds(ratio, _LASTING * whole, _LASTING * rest))


def _log_odds(ratio: float, whole: float, rest: float) -> float:
    """Of a ratio of mean squares of so many numbers: by variances that differ tenfold or more, against equal ones."""
    excess = whole * ratio / rest
    logs = -0.5 * whole * np.log(_RATIOS) + 0.5 * (whole + rest) * (np.log1p(excess) - np.log1p(excess / _RATIOS))
    return float(logsumexp(logs) - np.log(len(logs)))


def _squares(trial: MeasuredTrial) -> _Squares | None:
    """Of one trial, over the frames in which all markers count that mostly do; None where these, or they, are few."""
    gait = Gait.of(trial)
    told = gait.usable.mean(axis=0) >= _MOSTLY
    frames, markers = np.flatnonzero(gait.usable[:, told].all(axis=1)), int(told.sum())
    begun_s = gait.time_s - gait.time_s[0]
    columns = np.column_stack([smooth_swim(gait), *(np.exp(-begun_s / each) for each in _SETTLES_S)])[frames]
    stretch = np.floor(gait.time_s[frames] / _STRETCH_S).astype(int)
    if len(np.unique(stretch)) <= columns.shape[1] or markers <= _WHOLE:
        return None
    time_s = gait.time_s[frames]
    place, cruise = (each[frames] for each in gait.cruising(trial.position_m[trial.kept]))
    place = place[:, told]
    fitted = place - _beside(columns, place)
    speed = cruise[:, None] + np.gradient(fitted, time_s, axis=0)
    left = _beside(columns, place) - _late(columns, place, speed, time_s)
    noise = np.ones(markers)
    for _ in range(_ROUNDS):
        whole, rest, motion = _split(left, fitted, noise, stretch)
        noise = np.maximum(np.sqrt((np.abs(rest) ** 2).mean(axis=0)) * noise, _LEAST_M)
    stretches, free = len(whole), 1 - columns.shape[1] / len(np.unique(stretch))
    rest_count = stretches * (2 * markers - _WHOLE)
    whole_square, rest_square = (whole**2).sum() / whole.size, (np.abs(rest) ** 2).sum() / rest_count
    rest_square = max(rest_square, 0.5)  # where markers are better than is believed
    share = max(1 - rest_square / whole_square, 0.0)
    return _Squares(whole_square, rest_square, free * whole.size, free * rest_count, float(np.sqrt(share) * motion))


def _beside(columns: np.ndarray, series: np.ndarray) -> np.ndarray:
    """(n, k) what columns (n, c) leave of series (n, k)."""
    return np.asarray(series - columns @ np.linalg.lstsq(columns, series, rcond=None)[0])


def _late(columns: np.ndarray, place: np.ndarray, speed: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """(n, m) of places (n, m), beside columns (n, c), what markers at a speed (n, m) do when a beat wanders in time."""
    knots = np.linspace(time_s[0], time_s[-1], max(round(float(np.ptp(time_s)) / _WANDERS_S), 1) + 1)
    hats = np.maximum(1 - np.abs(time_s[:, None] - knots) / (knots[1] - knots[0]), 0.0)  # (n, h)
    shifted = _beside(columns, (speed[..., None] * hats[:, None]).reshape(len(time_s), -1)).reshape(-1, len(knots))
    both, left = np.concatenate([shifted.real, shifted.imag]), _beside(columns, place).ravel()
    delay_s = np.linalg.lstsq(both, np.concatenate([left.real, left.imag]), rcond=None)[0]
    return np.asarray((shifted @ delay_s).reshape(place.shape))


def _split(
    left: np.ndarray, fitted: np.ndarray, noise: np.ndarray, stretch: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """(b, 3) of the whole's motion over b stretches, (b, m) of the rest, both over noise (m,), and the motion's rms, m.

    Args:
        left: (n, m) of drift and harmonics, along + i across, m.
        fitted: (n, m) the beat, m.
        noise: (m,) of each marker, m.
        stretch: (n,) number of each frame's.
    """
    weight = np.concatenate([1 / noise, 1 / noise])
    rests, wholes, moved = [], [], []
    for number in np.unique(stretch):
        own = stretch == number
        arm = fitted[own].mean(axis=0) - fitted[own].mean()
        modes = np.array([np.ones_like(arm), 1j * np.ones_like(arm), 1j * arm])
        basis, _ = np.linalg.qr(np.hstack([modes.real, modes.imag]).T * weight[:, None])  # (2 m, 3)
        seen = left[own].mean(axis=0)
        row = np.concatenate([seen.real, seen.imag]) * weight
        wholes.append(basis.T @ row)
        moved.append((basis @ wholes[-1]) / weight)
        rest = row - basis @ wholes[-1]
        rests.append(rest[: len(noise)] + 1j * rest[len(noise) :])
    return np.array(wholes), np.array(rests), float(np.sqrt(2 * np.mean(np.square(moved))))
