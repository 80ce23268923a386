"""A part of the tracks' noise that stays for a while, and that neighbouring markers may have in common."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class NoisePart:
    """A part of the noise of every marker.

    Attributes:
        share: of a marker's variance.
        scale_s: in which the correlation of an Ornstein-Uhlenbeck process falls to 1/e; of a smooth process (squared
            exponential) to exp(-1/2).
        smooth: which of the two it is.
        across: (m, m) correlation between markers.
    """

    share: float
    scale_s: float
    smooth: bool
    across: np.ndarray

    def over(self, time_s: np.ndarray) -> np.ndarray:
        """(n, n) covariance between times (n,), of a marker of unit variance."""
        return self.share * falling(np.abs(time_s[:, None] - time_s), self.scale_s, self.smooth)


def falling(lag_s: np.ndarray, scale_s: float, smooth: bool) -> np.ndarray:
    """Correlation over a lag of any shape."""
    lags = lag_s / scale_s
    return np.exp(-0.5 * lags**2) if smooth else np.exp(-lags)
