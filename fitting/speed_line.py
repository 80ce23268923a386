"""The baseline that every forecast of a speed has to beat: a straight line in frequency through the fitted trials."""

from collections.abc import Sequence

import numpy as np


def speed_line(fitted_hz: Sequence[float], fitted_speed: Sequence[float], hz: Sequence[float]) -> list[float]:
    """Speeds by a straight line in frequency through the fitted trials, m/s; nan without any.

    Of trials of one frequency alone the line goes through the origin, so that the stride is constant. A held-out trial
    is to be asked for at the frequency of its first two beats, as the twin is.

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
