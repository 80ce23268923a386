"""Series in time: missing samples bridged, and weighted regression on a drift and the first harmonics of a beat."""

import numpy as np


def bridged(time_s: np.ndarray, series: np.ndarray, at_s: np.ndarray | None = None) -> np.ndarray:
    """(m, k) series (n, k) at m times, by default their own, interpolated over nan; 0 where one is never seen."""
    at_s = time_s if at_s is None else at_s
    result = np.zeros((len(at_s), series.shape[1]))
    for k, column in enumerate(series.T):
        if (seen := np.isfinite(column)).any():
            result[:, k] = np.interp(at_s, time_s[seen], column[seen])
    return result


def waves(turn_rad: np.ndarray, harmonics: int) -> np.ndarray:
    """(n, 2 h) cosine and sine of each harmonic of a turn (n,)."""
    return np.stack([wave(k * turn_rad) for k in range(1, harmonics + 1) for wave in (np.cos, np.sin)], axis=1)


def design(time_s: np.ndarray, frequency_hz: float, harmonics: int) -> np.ndarray:
    """(n, 2 + 2 * harmonics) columns: a constant and a drift in time, then cosine and sine of each harmonic.

    Time is counted from `time_s` = 0; phases therefore refer to time 0.
    """
    span = max(float(np.ptp(time_s)), 1e-9)
    drift = (time_s - time_s.mean()) / span
    return np.column_stack([np.ones_like(drift), drift, waves(2 * np.pi * frequency_hz * time_s, harmonics)])


def weighted_fit(columns: np.ndarray, series: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """(c, k) coefficients of each of k series (n, k) on columns (n, c), with weights (n, k).

    A series without enough weight gets the solution of least norm.
    """
    y = np.where(weight > 0, np.nan_to_num(series), 0.0)
    count = columns.shape[1]
    products = (columns[:, :, None] * columns[:, None, :]).reshape(len(columns), -1)
    normal = (weight.T @ products).reshape(-1, count, count)  # (k, c, c)
    moment = (weight * y).T @ columns  # (k, c)
    ridge = 1e-12 * np.trace(normal, axis1=1, axis2=2)[:, None, None] + 1e-300
    return np.linalg.solve(normal + ridge * np.eye(count), moment[..., None])[..., 0].T
