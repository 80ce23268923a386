"""Forward speed, measured over whole beats, so that the beat does not tilt it, and by simple rules in frequency."""

from collections.abc import Sequence

import numpy as np


def whole_beats(time_s: np.ndarray, kept: np.ndarray, frequency_hz: float) -> np.ndarray:
    """(n,) mask of the longest run of whole beats from the first kept frame; all kept frames if not one beat fits."""
    if not kept.any():
        return kept
    start, end = time_s[kept][[0, -1]]
    frame = float(np.median(np.diff(time_s)))
    beats = np.floor((end - start + frame) * frequency_hz + 1e-6)
    if beats < 1:
        return kept
    return kept & (time_s < start + beats / frequency_hz - frame / 2 + 1e-9)


def forward_speed(time_s: np.ndarray, forward_m: np.ndarray, kept: np.ndarray, frequency_hz: float) -> np.ndarray:
    """Least-squares slope of the distance swum over the whole beats within the kept frames.

    Args:
        time_s: (n,) s.
        forward_m: (..., n) distance along the head's own axis, forward positive, m.
        kept: (n,) which frames may be used.
        frequency_hz: beats a second.

    Returns:
        (...) m/s; nan where fewer than two frames are kept.
    """
    used = whole_beats(time_s, kept, frequency_hz)
    if used.sum() < 2:
        return np.full(forward_m.shape[:-1], np.nan)
    t = time_s[used] - time_s[used].mean()
    return (forward_m[..., used] @ t) / (t @ t)


def speed_line(fitted_hz: Sequence[float], fitted_speed: Sequence[float], hz: Sequence[float]) -> list[float]:
    """Speeds by a straight line in frequency through the fitted trials, m/s; nan without any.

    Of trials of one frequency alone the line goes through the origin, so that the stride is constant. A held-out trial
    is forecast at the frequency of its first two beats, as by the twin.

    Args:
        fitted_hz, fitted_speed: (n,) measured beat frequencies, Hz, and forward speeds, m/s.
        hz: (k,) frequencies of the forecasts.
    """
    x, y, at = (np.array(values, float) for values in (fitted_hz, fitted_speed, hz))
    if len(x) == 0:
        return [float("nan")] * len(at)
    if np.ptp(x) > 0:
        slope, constant = np.polyfit(x, y, 1)
        return list(map(float, constant + slope * at))
    return list(map(float, np.mean(y / x) * at))


def speed_power_law(fitted_hz: Sequence[float], fitted_speed: Sequence[float], hz: Sequence[float]) -> list[float]:
    """Speeds by a power of the frequency through the fitted trials, m/s; arguments as for `speed_line`.

    nan where a fitted trial did not swim forward. Of trials of one frequency alone the stride is constant.
    """
    x, y, at = (np.array(values, float) for values in (fitted_hz, fitted_speed, hz))
    if len(x) == 0 or (y <= 0).any():
        return [float("nan")] * len(at)
    if np.ptp(x) == 0:
        return speed_constant_stride(fitted_hz, fitted_speed, hz)
    power, constant = np.polyfit(np.log(x), np.log(y), 1)
    return list(map(float, np.exp(constant) * at**power))


def speed_constant_stride(
    fitted_hz: Sequence[float], fitted_speed: Sequence[float], hz: Sequence[float]
) -> list[float]:
    """Speeds in proportion to the frequency, by the mean distance a beat, m/s; arguments as for `speed_line`."""
    if not len(fitted_hz):
        return [float("nan")] * len(hz)
    stride = float(np.mean(np.array(fitted_speed) / np.array(fitted_hz)))
    return [stride * each for each in hz]


BASELINES = {"line": speed_line, "power_law": speed_power_law, "constant_stride": speed_constant_stride}
"""That every forecast of a speed has to beat, by name."""
