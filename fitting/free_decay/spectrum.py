"""How a released tail rings: its spectrum, and the damped sine that all its markers share."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.signal import find_peaks
from scipy.signal.windows import hann

from fitting.free_decay.damped_sine import DampedSine, fit_damped_sine, frequency_error
from fitting.free_decay.decay_trial import DecayTrial
from fitting.series import bridged
from session import Flag

HIGHEST_HZ = 15.0
FEWEST_PERIODS = 2.0  # recorded after the release
LEAST_SE = 0.02  # relative standard error of the frequency that is worth a flag
SECOND_PEAK = 0.5  # of the highest, from which a spectrum has two
PEAK_PROMINENCE = 0.3  # of the highest, by which a peak stands out of the valley before it
NO_RING = 0.7  # damping ratio beyond which no swing is left to time
_FINER = 16  # times as many bins as the record has


@dataclass(frozen=True, eq=False)
class DecaySpectrum:
    """How a tail rings, from k markers from head to fin.

    Attributes:
        bins_hz: (b,) frequencies of the spectrum, Hz.
        amplitude_m: (b, k) windowed amplitude spectrum of the lateral motion, m.
        peak_hz: peak of the markers' rms spectrum, between the bins; None where it has none. This is what a published
            FFT reports; damping and the window draw it away from the frequency of the ring.
        ring: the damped sine.
        frequency_se_hz: standard error of its frequency.
        flags: what is doubtful.
    """

    bins_hz: np.ndarray
    amplitude_m: np.ndarray
    peak_hz: float | None
    ring: DampedSine
    frequency_se_hz: float
    flags: tuple[Flag, ...]

    @property
    def rms_m(self) -> np.ndarray:
        """(b,) of all markers."""
        return np.sqrt((self.amplitude_m**2).mean(axis=1))


def measure_decay(trial: DecayTrial) -> DecaySpectrum:
    """The spectrum of a free decay and the damped sine all its markers share."""
    time_s, weight = trial.time_s, (trial.weight > 0).astype(float)
    lateral = trial.lateral_m
    ring = fit_damped_sine(time_s, lateral, weight)
    hz_se = frequency_error(time_s, lateral, weight, ring)
    bins_hz, amplitude = _spectrum(time_s, lateral, ring.rest_m)
    rms = np.sqrt((amplitude**2).mean(axis=1))
    doubts = (*_ring_flags(time_s, ring, hz_se), *_peak_flags(bins_hz, rms))
    return DecaySpectrum(bins_hz, amplitude, _peak(bins_hz, rms), ring, hz_se, doubts)


def _spectrum(time_s: np.ndarray, lateral_m: np.ndarray, rest_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(b,) Hz and (b, k) amplitudes under the falling half of a Hann window: a decay is strongest at its start."""
    step = float(np.median(np.diff(time_s)))
    even_s = np.arange(0.0, time_s[-1] + step / 2, step)
    swing = bridged(time_s, lateral_m - rest_m, even_s)
    window = hann(2 * len(even_s) + 1)[len(even_s) + 1 :]
    bins_hz = np.fft.rfftfreq(_FINER * len(even_s), step)
    amplitude = 2 * np.abs(np.fft.rfft(swing * window[:, None], _FINER * len(even_s), axis=0)) / window.sum()
    shown = bins_hz <= HIGHEST_HZ
    return bins_hz[shown], amplitude[shown]


def _peak(bins_hz: np.ndarray, rms: np.ndarray) -> float | None:
    """The highest peak, between the bins by a parabola through the logarithms."""
    peaks, _ = find_peaks(rms, prominence=PEAK_PROMINENCE / 10 * rms.max())
    if not len(peaks):
        return None
    top = int(peaks[np.argmax(rms[peaks])])
    before, at, after = np.log(rms[top - 1 : top + 2])
    return float(bins_hz[top] + 0.5 * (before - after) / (before - 2 * at + after) * (bins_hz[1] - bins_hz[0]))


def _ring_flags(time_s: np.ndarray, ring: DampedSine, hz_se: float) -> Iterator[Flag]:
    periods = ring.frequency_hz * float(time_s[-1])
    if periods < FEWEST_PERIODS:
        message = f"only {periods:.1f} periods are recorded after the release; expected at least {FEWEST_PERIODS:g}"
        yield Flag("too_short", message=message)
    elif not hz_se < LEAST_SE * ring.frequency_hz:
        message = f"the frequency is known to {100 * hz_se / ring.frequency_hz:.0f} % only (standard error)"
        yield Flag("unidentifiable", message=message)
    if ring.damping_ratio > NO_RING:
        message = f"the tail creeps back instead of ringing (damping ratio {ring.damping_ratio:.2f}): no frequency"
        yield Flag("unidentifiable", message=message)


def _peak_flags(bins_hz: np.ndarray, rms: np.ndarray) -> Iterator[Flag]:
    peaks, _ = find_peaks(rms, height=SECOND_PEAK * rms.max(), prominence=PEAK_PROMINENCE * rms.max())
    if len(peaks) > 1:
        both = " and ".join(f"{bins_hz[peak]:.2f} Hz" for peak in peaks[:2])
        message = f"the spectrum has peaks at {both}: the robot is touched, the clamp gives, or two swings are mixed"
        yield Flag("double_peaked", message=message)
