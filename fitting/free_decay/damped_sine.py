"""One damped sine shared by all tail markers, by separable least squares (Golub and Pereyra 1973).

Each marker has its own rest position, amplitude and phase; frequency and decay rate are common. This is the frequency
at which the tail rings; the peak of a spectrum is drawn away from it by damping and window (that of an impulse response
to f0 sqrt(1 - 2 zeta^2)).
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from fitting.frequency_error import standard_error
from fitting.series import weighted_fit

RATIOS = (0.01, 0.03, 0.08, 0.16, 0.3, 0.5)  # damping ratios tried first
BAND_HZ = (0.4, 15.0)
_SEARCHED = 28  # frequencies tried first
_SLOPE_STEP = 1e-4


@dataclass(frozen=True, eq=False)
class DampedSine:
    """How a tail rings.

    Attributes:
        frequency_hz: of the zero crossings (damped), Hz.
        decay_1_s: rate at which the envelope falls, 1/s.
        curve_m: (n, k) the fitted motion, m.
        envelope_m: (n, k) of the swing about the rest position, m.
        rest_m: (k,) where the markers rest, m.
    """

    frequency_hz: float
    decay_1_s: float
    curve_m: np.ndarray
    envelope_m: np.ndarray
    rest_m: np.ndarray

    @property
    def damping_ratio(self) -> float:
        """Decay rate over the undamped angular frequency."""
        return self.decay_1_s / float(np.hypot(self.decay_1_s, 2 * np.pi * self.frequency_hz))

    @property
    def natural_hz(self) -> float:
        """The frequency the same mode would have without damping."""
        return float(np.hypot(self.decay_1_s / (2 * np.pi), self.frequency_hz))


def fit_damped_sine(
    time_s: np.ndarray, lateral_m: np.ndarray, weight: np.ndarray, start: tuple[float, float] | None = None
) -> DampedSine:
    """The damped sine closest to all markers.

    Args:
        time_s: (n,) from 0, s.
        lateral_m: (n, k) m.
        weight: (n, k) 0 leaves a sample out.
        start: frequency (Hz) and decay rate (1/s) to start from; default: the best of a grid.
    """
    scale = float(np.sqrt((weight * np.nan_to_num(lateral_m) ** 2).sum())) + 1e-30

    def misfit(x: np.ndarray) -> np.ndarray:
        columns = design(time_s, *_natural(x))
        residual = np.nan_to_num(lateral_m) - columns @ weighted_fit(columns, lateral_m, weight)
        return (np.sqrt(weight) * residual).ravel() / scale

    frequency, rate = start or _best_of_grid(time_s, misfit)
    found = least_squares(misfit, [np.log(frequency), rate / frequency], xtol=1e-7, max_nfev=40)
    frequency, rate = _natural(found.x)
    columns = design(time_s, frequency, rate)
    coefficients = weighted_fit(columns, lateral_m, weight)  # (3, k)
    envelope = np.exp(-rate * time_s)[:, None] * np.hypot(coefficients[1], coefficients[2])
    return DampedSine(frequency, rate, columns @ coefficients, envelope, coefficients[0])


def design(time_s: np.ndarray, frequency_hz: float, decay_1_s: float) -> np.ndarray:
    """(n, 3) columns: the rest position, and the damped cosine and sine."""
    envelope, angle = np.exp(-decay_1_s * time_s), 2 * np.pi * frequency_hz * time_s
    return np.stack([np.ones_like(time_s), envelope * np.cos(angle), envelope * np.sin(angle)], axis=1)


def frequency_error(time_s: np.ndarray, lateral_m: np.ndarray, weight: np.ndarray, ring: DampedSine) -> float:
    """Standard error of the frequency, Hz, allowing for residuals that last and are shared."""
    columns = design(time_s, ring.frequency_hz, ring.decay_1_s)
    coefficients = weighted_fit(columns, lateral_m, weight)
    slopes = []
    for step in ((_SLOPE_STEP, 0.0), (0.0, _SLOPE_STEP)):
        moved = design(time_s, ring.frequency_hz + step[0], ring.decay_1_s + step[1])
        slope = (moved - columns) @ coefficients / _SLOPE_STEP  # (n, k)
        slopes.append(slope - columns @ weighted_fit(columns, slope, weight))
    of_hz, of_rate = slopes
    alone = of_hz - of_rate * (weight * of_hz * of_rate).sum() / max(float((weight * of_rate**2).sum()), 1e-300)
    frames = len(time_s) / max(ring.frequency_hz * float(np.ptp(time_s)), 1.0)
    return standard_error(columns, alone, np.nan_to_num(lateral_m) - ring.curve_m, weight, frames)


def _natural(x: np.ndarray) -> tuple[float, float]:
    frequency = float(np.exp(np.clip(x[0], np.log(0.05), np.log(100.0))))
    return frequency, float(np.clip(x[1], -1.0, 60.0)) * frequency


def _best_of_grid(time_s: np.ndarray, misfit) -> tuple[float, float]:  # type: ignore[no-untyped-def]
    span, step = float(np.ptp(time_s)), float(np.median(np.diff(time_s)))
    frequencies = np.geomspace(max(BAND_HZ[0], 0.4 / span), min(BAND_HZ[1], 0.4 / step), _SEARCHED)
    tried = [(f, 2 * np.pi * f * z / np.sqrt(1 - z**2)) for f in frequencies for z in RATIOS]
    scores = [float((misfit(np.array([np.log(f), rate / f])) ** 2).sum()) for f, rate in tried]
    return tried[int(np.argmin(scores))]
