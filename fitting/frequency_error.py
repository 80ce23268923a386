"""The standard error of a frequency or a speed whose residuals last: autoregressive noise, by restricted likelihood.

Tracking errors stay for several frames and are shared by the markers. Summing their covariance lag by lag (Newey and
West 1987) finds too little of it, because the regression of each marker has eaten the residual near its harmonics,
just where the frequency is sensitive. Restricted likelihood (Patterson and Thompson 1971) allows for that. The noise
is taken as first-order autoregressive in means over short blocks of frames, in which white noise averages out.
"""

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter
from scipy.special import softmax

BLOCKS_PER_BEAT = 16.0
CORRELATIONS = np.append(0.0, 1 - np.geomspace(0.7, 0.005, 24))  # tried between neighbouring blocks


def standard_error(
    columns: np.ndarray,
    slope: np.ndarray,
    residual: np.ndarray,
    weight: np.ndarray,
    frames_per_beat: float,
) -> float:
    """Standard error of a number that k markers share (a frequency, a speed), when all else is fitted to each of them.

    Args:
        columns: (n, c) the regressors of each marker.
        slope: (n, k) d model / d number, such as m/Hz; the number is sum(slope * series) / sum(slope^2).
        residual: (n, k) m.
        weight: (n, k) of each sample in the regression, 0 leaves it out.
        frames_per_beat: how many.

    Returns:
        In the number's unit; nan where no marker has more blocks than regressors, or none beats.
    """
    block = np.arange(len(residual)) // max(round(frames_per_beat / BLOCKS_PER_BEAT), 1)
    total = _summed(weight, block)  # (b, k)
    pull = _summed(weight * slope, block)  # (b, k) of each block's mean residual on the frequency
    markers = []
    for k in range(residual.shape[1]):
        used = np.flatnonzero(total[:, k] > 0)
        series = np.column_stack([residual[:, k], columns, slope[:, k]])
        mean = _summed(weight[:, k : k + 1] * series, block)[used] / total[used, k : k + 1]
        markers.append(_Marker(used, mean[:, 0], mean[:, 1:]))
    curvature = float((weight * slope**2).sum())
    if curvature <= 0 or all(marker.freedom <= 0 for marker in markers):
        return float("nan")
    spreads, deviances = np.array([_spread(pull, markers, correlation) for correlation in CORRELATIONS]).T
    spread = softmax(-deviances / 2) @ spreads  # the correlation is not known either
    return float(np.sqrt(spread)) / curvature


@dataclass(frozen=True, eq=False)
class _Marker:
    """Mean residuals (b,) and regressors (b, c) of one marker in its usable blocks."""

    blocks: np.ndarray
    residual: np.ndarray
    columns: np.ndarray

    @property
    def freedom(self) -> int:
        return len(self.residual) - self.columns.shape[1]

    def innovations(self, correlation: float) -> tuple[np.ndarray, float]:
        """(b,) residuals freed of their correlation, and their restricted log-likelihood times -2."""
        carried = np.append(0.0, correlation ** np.diff(self.blocks))  # (b,) from the block before
        scale = np.sqrt(1 - carried**2)

        def whitened(series: np.ndarray) -> np.ndarray:
            before = np.concatenate([series[:1], series[:-1]])
            return ((series.T - carried * before.T) / scale).T

        columns = whitened(self.columns)
        basis, triangle = np.linalg.qr(columns)
        fresh = whitened(self.residual)
        fresh = fresh - basis @ (basis.T @ fresh)
        variance = float(fresh @ fresh) / self.freedom + 1e-30
        log_volume = 2 * float(np.log(np.abs(np.diag(triangle)) + 1e-30).sum())
        return fresh, self.freedom * np.log(variance) + log_volume + 2 * float(np.log(scale).sum())


def _spread(pull: np.ndarray, markers: list[_Marker], correlation: float) -> tuple[float, float]:
    """Variance of the sum of all pulls (b, k) for this correlation, and its restricted log-likelihood times -2."""
    fresh, deviance = np.zeros_like(pull), 0.0
    for k, marker in enumerate(markers):
        if marker.freedom > 0:
            innovations, own = marker.innovations(correlation)
            fresh[marker.blocks, k] = innovations / np.sqrt(marker.freedom)
            deviance += own
    reach = 2 * lfilter([1.0], [1.0, -correlation], pull, axis=0) - pull
    return float(np.einsum("bk,kl,bl->", reach, fresh.T @ fresh, pull)), deviance


def _summed(values: np.ndarray, block: np.ndarray) -> np.ndarray:
    """(b, k) sums of (n, k) over the frames of each block."""
    return np.add.reduceat(values, np.flatnonzero(np.diff(block, prepend=-1)), axis=0)
