"""Series in time: missing samples interpolated, regression on a drift and harmonics, and whether samples allow it."""

import numpy as np


def bridged(time_s: np.ndarray, series: np.ndarray, at_s: np.ndarray | None = None) -> np.ndarray:
    """Interpolate series over missing samples.

    Args:
        time_s: (n,) times.
        series: (n, k), nan where missing.
        at_s: (m,) times of the result; by default those of the series.

    Returns:
        (m, k); 0 where a series is never seen.
    """
    at_s = time_s if at_s is None else at_s
    result = np.zeros((len(at_s), series.shape[1]))
    for k, column in enumerate(series.T):
        if (seen := np.isfinite(column)).any():
            result[:, k] = np.interp(at_s, time_s[seen], column[seen])
    return result


def waves(turn_rad: np.ndarray, harmonics: int) -> np.ndarray:
    """Return cosine and sine of each harmonic of a turn, (n, 2 h).

    Args:
        turn_rad: (n,) turn of the crank.
        harmonics: number h of harmonics.
    """
    angles = np.multiply.outer(turn_rad, np.arange(1, harmonics + 1))  # (n, h)
    return np.stack([np.cos(angles), np.sin(angles)], axis=-1).reshape(len(turn_rad), -1)


def smooth_swim(time_s: np.ndarray, turn_rad: np.ndarray, degree: int, harmonics: int) -> np.ndarray:
    """Return the regressors of a smooth swim: powers of the time from -1 to 1, then cosine and sine of each harmonic.

    Args:
        time_s: (n,) times.
        turn_rad: (n,) turn of the crank.
        degree: highest power of the time.
        harmonics: number of harmonics.

    Returns:
        (n, degree + 1 + 2 harmonics).
    """
    scaled = 2 * (time_s - time_s[0]) / (time_s[-1] - time_s[0]) - 1
    return np.column_stack([*(scaled**k for k in range(degree + 1)), waves(turn_rad, harmonics)])


def design(time_s: np.ndarray, frequency_hz: float, harmonics: int) -> np.ndarray:
    """Return the regressors of a beat: a constant and a drift in time, then cosine and sine of each harmonic.

    Time is counted from `time_s` = 0; phases therefore refer to time 0.

    Args:
        time_s: (n,) times.
        frequency_hz: beats a second.
        harmonics: number of harmonics.

    Returns:
        (n, 2 + 2 harmonics).
    """
    span = max(float(np.ptp(time_s)), 1e-9)
    drift = (time_s - time_s.mean()) / span
    return np.column_stack([np.ones_like(drift), drift, waves(2 * np.pi * frequency_hz * time_s, harmonics)])


def weighted_fit(columns: np.ndarray, series: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return the weighted least-squares coefficients (c, k) of each of k series on the columns.

    A series without enough weight gets the solution of least norm.

    Args:
        columns: (n, c) regressors.
        series: (n, k).
        weight: (n, k).
    """
    y = np.where(weight > 0, np.nan_to_num(series), 0.0)
    count = columns.shape[1]
    products = (columns[:, :, None] * columns[:, None, :]).reshape(len(columns), -1)
    normal = (weight.T @ products).reshape(-1, count, count)  # (k, c, c)
    moment = (weight * y).T @ columns  # (k, c)
    ridge = 1e-12 * np.trace(normal, axis1=1, axis2=2)[:, None, None] + 1e-300
    return np.linalg.solve(normal + ridge * np.eye(count), moment[..., None])[..., 0].T


# Largest variance inflation: that of a marker seen in 1 frame of 100 over all phases, or on 2/3 of each beat.
_LARGEST_INFLATION = 100.0
_FRAMES_A_COLUMN = 2  # least frames for each regressor


def determined(columns: np.ndarray, usable: np.ndarray, worst: float = _LARGEST_INFLATION) -> np.ndarray:
    """Tell which series have the samples that a regression needs.

    Args:
        columns: (n, c) regressors.
        usable: (n, m) samples of each series that count.
        worst: largest variance of a coefficient against that of orthogonal regressors seen in all n frames (the
            variance inflation factor times n over the samples; Marquardt 1970, Technometrics 12, 591).

    Returns:
        (m,) True where there are twice as many samples as regressors, and no variance is larger than that.
    """
    count, squares = columns.shape[1], np.maximum((columns**2).sum(axis=0), 1e-300)  # n times the mean squares
    scaled = columns / np.sqrt(squares)
    masks, which = np.unique(usable, axis=1, return_inverse=True)
    good = np.zeros(masks.shape[1], bool)
    for number, mask in enumerate(masks.T):
        if mask.sum() >= _FRAMES_A_COLUMN * count:
            values, vectors = np.linalg.eigh(scaled[mask].T @ scaled[mask])
            if values[0] > 1e-12:
                good[number] = bool(((vectors**2 / values).sum(axis=1) <= worst).all())
    return good[which.ravel()]
