"""The baselines that every forecast of a speed has to beat: a line, a power law, a constant stride in frequency."""

from collections.abc import Sequence

import numpy as np


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
