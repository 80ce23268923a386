"""Spectrum of a released tail, the first estimate of how it rings, for both the measured tail and the twin's."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import find_peaks
from scipy.signal.windows import hann

from fitting.free_decay.decay_trial import DecayTrial
from fitting.series import bridged
from session import Flag

HIGHEST_HZ = 15.0
FEWEST_PERIODS = 2.0  # least number of periods recorded after the release
SECOND_PEAK = 0.5  # least height of a second peak, relative to the highest
PEAK_PROMINENCE = 0.3  # least prominence of a peak over the valley before it, relative to the highest
AT_REST = 2 / 3  # share of the recording after which the tail is taken to rest
_FINER = 16  # factor by which the spectrum has more bins than the record


@dataclass(frozen=True, eq=False)
class DecaySpectrum:
    """Spectrum of a ringing tail, from k markers from head to fin.

    Attributes:
        bins_hz: (b,) frequencies of the spectrum, Hz.
        amplitude_m: (b, k) windowed amplitude spectrum of the lateral motion, m.
        peak_hz: peak of the markers' rms spectrum, between the bins; None where it has none, as the tail creeps back.
        decay_1_s: rate at which the swing falls, 1/s: an exponential's squares have their centroid at 1 / (2 rate).
        rest_m: (k,) where the markers rest, m.
        flags: what is doubtful about it.
    """

    bins_hz: np.ndarray
    amplitude_m: np.ndarray
    peak_hz: float | None
    decay_1_s: float
    rest_m: np.ndarray
    flags: tuple[Flag, ...] = ()

    @property
    def rms_m(self) -> np.ndarray:
        """Root mean square amplitude over all markers, (b,)."""
        return np.sqrt((self.amplitude_m**2).mean(axis=1))


def measure_decay(trial: DecayTrial) -> DecaySpectrum:
    """Compute the spectrum of a free decay, with flags."""
    found = spectrum_of(trial.time_s, trial.lateral_m)
    return replace(found, flags=(*_peak_flags(found), *_ring_flags(float(trial.time_s[-1]), found.peak_hz)))


def spectrum_of(time_s: np.ndarray, lateral_m: np.ndarray) -> DecaySpectrum:
    """Compute the spectrum of motions.

    The window is the falling half of Hann's, as a decay begins strongest.

    Args:
        time_s: (n,) s.
        lateral_m: (n, k) motions, m, nan where missing.
    """
    step = float(np.median(np.diff(time_s)))
    even_s = np.arange(0.0, time_s[-1] + step / 2, step)
    lateral = bridged(time_s, lateral_m, even_s)
    rest = lateral[round(AT_REST * len(lateral)) :].mean(axis=0)
    swing = lateral - rest
    window = hann(2 * len(even_s) + 1)[len(even_s) + 1 :]
    bins_hz = np.fft.rfftfreq(_FINER * len(even_s), step)
    amplitude = 2 * np.abs(np.fft.rfft(swing * window[:, None], _FINER * len(even_s), axis=0)) / window.sum()
    shown = bins_hz <= HIGHEST_HZ
    square = (swing**2).sum(axis=1)
    rate = float(square.sum() / max(2 * (even_s @ square), 1e-300))
    found = DecaySpectrum(bins_hz[shown], amplitude[shown], None, rate, rest)
    return replace(found, peak_hz=_peak(found.bins_hz, found.rms_m))


def _peak(bins_hz: np.ndarray, rms: np.ndarray) -> float | None:
    """Return the frequency of the highest peak, between the bins by a parabola through the logarithms."""
    peaks, _ = find_peaks(rms, prominence=PEAK_PROMINENCE / 10 * rms.max())
    if not len(peaks):
        return None
    top = int(peaks[np.argmax(rms[peaks])])
    before, at, after = np.log(rms[top - 1 : top + 2])
    return float(bins_hz[top] + 0.5 * (before - after) / (before - 2 * at + after) * (bins_hz[1] - bins_hz[0]))


def _ring_flags(seconds: float, peak_hz: float | None) -> Iterator[Flag]:
    if peak_hz is None:
        message = "the tail creeps back instead of ringing: its spectrum has no peak"
        yield Flag("unidentifiable", message=message)
    elif (periods := peak_hz * seconds) < FEWEST_PERIODS:
        message = f"only {periods:.1f} periods are recorded after the release; expected at least {FEWEST_PERIODS:g}"
        yield Flag("too_short", message=message)


def _peak_flags(spectrum: DecaySpectrum) -> Iterator[Flag]:
    bins_hz, rms = spectrum.bins_hz, spectrum.rms_m
    peaks, _ = find_peaks(rms, height=SECOND_PEAK * rms.max(), prominence=PEAK_PROMINENCE * rms.max())
    if len(peaks) > 1:
        both = " and ".join(f"{bins_hz[peak]:.2f} Hz" for peak in peaks[:2])
        message = f"the spectrum has peaks at {both}: the robot is touched, the clamp gives, or two swings are mixed"
        yield Flag("double_peaked", message=message)
