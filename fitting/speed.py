"""Forward speed, measured over whole beats, so that the beat does not bias it, and by simple rules in frequency."""

from collections.abc import Sequence

import numpy as np

from fitting.series import design
from tracking import HeadFrame

_HARMONICS = 3
_LEAST_BEATS = 1.0  # below this number of beats a drift cannot be told from the beat


def whole_beats(time_s: np.ndarray, kept: np.ndarray, frequency_hz: float) -> np.ndarray:
    """Return the mask (n,) of the longest run of whole beats from the first kept frame; all kept frames if none fits.

    Args:
        time_s: (n,) s.
        kept: (n,) which frames may be used.
        frequency_hz: beats a second.
    """
    if not kept.any():
        return kept
    start, end = time_s[kept][[0, -1]]
    frame = float(np.median(np.diff(time_s)))
    beats = np.floor((end - start + frame) * frequency_hz + 1e-6)
    if beats < _LEAST_BEATS:
        return kept
    return kept & (time_s < start + beats / frequency_hz - frame / 2 + 1e-9)


def forward_speed(time_s: np.ndarray, head: HeadFrame, kept: np.ndarray, frequency_hz: float) -> np.ndarray:
    """Return the net displacement in the pool along the mean heading, for each second.

    The nose's path is fitted by a straight line and three harmonics of the beat (least squares), so that the slope is
    that of whole beats; the mean heading is fitted together with a drift and the same harmonics. So the phases at which
    the window begins and ends, the frame rate and gaps do not bias it. Of a fish whose course bends by an angle a it is
    1 - a^2 / 40 of the speed along its path.

    Args:
        time_s: (n,) s.
        head: head frame of trajectories (..., n, m, 2); frames in which it is not seen (nan headings) do not count.
        kept: (n,) which frames may be used.
        frequency_hz: beats a second.

    Returns:
        (...) m/s, forward positive; nan where fewer than three frames are seen.
    """
    heading = head.heading_rad.reshape(-1, len(time_s))
    found = np.full(len(heading), np.nan)
    standing = np.isfinite(head.nose_m).all(axis=(-2, -1)).reshape(-1)  # no simulation that diverged
    seen = np.isfinite(heading[standing]).all(axis=0) if standing.any() else np.zeros(len(time_s), bool)
    used = kept & seen
    if used.sum() < 3:
        return found.reshape(head.heading_rad.shape[:-1])
    span = float(np.ptp(time_s[used]))
    frame = float(np.median(np.diff(time_s)))
    whole = (span + 1.5 * frame) * frequency_hz >= _LEAST_BEATS  # time stamps are not even
    harmonics = min(_HARMONICS, (int(used.sum()) - 3) // 2) if whole else 0
    read = np.linalg.pinv(design(time_s[used], frequency_hz, harmonics))[:2]  # mean and drift over the span
    velocity = np.einsum("n,snx->sx", read[1] / span, head.nose_m.reshape(len(heading), -1, 2)[standing][:, used])
    direction = heading[standing][:, used] @ read[0]
    found[standing] = -(velocity[:, 0] * np.cos(direction) + velocity[:, 1] * np.sin(direction))
    return found.reshape(head.heading_rad.shape[:-1])


def speed_line(fitted_hz: Sequence[float], fitted_speed: Sequence[float], hz: Sequence[float]) -> list[float]:
    """Return the speeds by a straight line in frequency through the fitted trials, m/s; nan without any.

    If all trials have one frequency the line goes through the origin, so that the stride is constant. A held-out trial
    is forecast at the frequency of its first two beats, as by the twin.

    Args:
        fitted_hz: (n,) measured beat frequencies, Hz.
        fitted_speed: (n,) forward speeds, m/s.
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
    """Return the speeds by a power of the frequency through the fitted trials, m/s.

    They are nan where a fitted trial did not swim forward. If all trials have one frequency the stride is constant.

    Args:
        fitted_hz: (n,) measured beat frequencies, Hz.
        fitted_speed: (n,) forward speeds, m/s.
        hz: (k,) frequencies of the forecasts.
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
    """Return the speeds in proportion to the frequency, by the mean distance a beat, m/s.

    Args:
        fitted_hz: (n,) measured beat frequencies, Hz.
        fitted_speed: (n,) forward speeds, m/s.
        hz: (k,) frequencies of the forecasts.
    """
    if not len(fitted_hz):
        return [float("nan")] * len(hz)
    stride = float(np.mean(np.array(fitted_speed) / np.array(fitted_hz)))
    return [stride * each for each in hz]


BASELINES = {"line": speed_line, "power_law": speed_power_law, "constant_stride": speed_constant_stride}
"""Simple rules that every forecast of a speed has to beat, by name."""
