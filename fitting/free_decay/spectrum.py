"""How a released tail rings: its spectrum, frequency, damping, and whether the markers agree."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import find_peaks
from scipy.signal.windows import hann

from fitting.free_decay.damped_sine import DampedSine, fit_damped_sine, ring_errors
from fitting.free_decay.decay_trial import DecayTrial
from session import Flag

HIGHEST_HZ = 15.0
FEWEST_PERIODS = 2.0  # recorded after the release
LEAST_SE = 0.02  # relative standard error of the frequency that is worth a flag
SECOND_PEAK = 0.5  # of the highest, from which a spectrum has two
PEAK_PROMINENCE = 0.3  # of the highest, by which a peak stands out of the valley before it
DISAGREE = 0.03  # relative difference of a marker's frequency that is worth a flag …
DISAGREE_SE = 4.0  # … if it is also this many standard errors
QUIET = 0.05  # of the widest swing, below which a marker moves too little to be timed alone; …
QUIET_M = 0.002  # … so does one that swings by less than this
NO_RING = 0.7  # damping ratio beyond which no swing is left to time
_FINER = 16  # times as many bins as the record has


@dataclass(frozen=True, eq=False)
class DecaySpectrum:
    """How a tail rings, from k markers.

    Attributes:
        markers: the k markers, from head to fin.
        bins_hz: (b,) frequencies of the spectrum, Hz.
        amplitude_m: (b, k) windowed amplitude spectrum of the lateral motion, m.
        peak_hz: peak of the markers' rms spectrum, between the bins; None where it has none. This is what a published
            FFT reports; damping and the window draw it away from `frequency_hz`.
        frequency_hz, frequency_se_hz: of the zero crossings (damped), with its standard error.
        natural_hz: what it would be without damping.
        decay_1_s, decay_se_1_s: rate at which the envelope falls.
        damping_ratio, damping_ratio_se: decay rate over the undamped angular frequency.
        marker_hz, marker_se_hz: (k,) frequency of each marker alone; nan where it moves too little.
        ring: the damped sine itself, with its envelope.
        flags: what is doubtful.
    """

    markers: tuple[str, ...]
    bins_hz: np.ndarray
    amplitude_m: np.ndarray
    peak_hz: float | None
    frequency_hz: float
    frequency_se_hz: float
    natural_hz: float
    decay_1_s: float
    decay_se_1_s: float
    damping_ratio: float
    damping_ratio_se: float
    marker_hz: np.ndarray
    marker_se_hz: np.ndarray
    ring: DampedSine
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
    hz_se, rate_se = ring_errors(time_s, lateral, weight, ring)
    marker_hz, marker_se_hz = np.array([_alone(trial, k, ring) for k in range(len(trial.markers))]).T
    bins_hz, amplitude = _spectrum(time_s, lateral, ring.rest_m)
    rms = np.sqrt((amplitude**2).mean(axis=1))
    omega, rate = 2 * np.pi * ring.frequency_hz, ring.decay_1_s
    ratio_se = float(np.hypot(omega * rate_se, rate * 2 * np.pi * hz_se)) * omega / np.hypot(omega, rate) ** 3
    return DecaySpectrum(
        markers=trial.markers,
        bins_hz=bins_hz,
        amplitude_m=amplitude,
        peak_hz=_peak(bins_hz, rms),
        frequency_hz=ring.frequency_hz,
        frequency_se_hz=hz_se,
        natural_hz=ring.natural_hz,
        decay_1_s=rate,
        decay_se_1_s=rate_se,
        damping_ratio=ring.damping_ratio,
        damping_ratio_se=ratio_se,
        marker_hz=marker_hz,
        marker_se_hz=marker_se_hz,
        ring=ring,
        flags=(
            *_ring_flags(time_s, ring, hz_se),
            *_peak_flags(bins_hz, rms),
            *_marker_flags(trial.markers, marker_hz, marker_se_hz, ring.frequency_hz, hz_se),
        ),
    )


def _alone(trial: DecayTrial, k: int, ring: DampedSine) -> tuple[float, float]:
    """Frequency of one marker and its standard error; nan where too little is seen of it."""
    lateral, weight = trial.lateral_m[:, [k]], (trial.weight[:, [k]] > 0).astype(float)
    if weight.sum() < 8 or ring.envelope_m[0, k] < max(QUIET_M, QUIET * ring.envelope_m[0].max()):
        return float("nan"), float("nan")
    own = fit_damped_sine(trial.time_s, lateral, weight, (ring.frequency_hz, ring.decay_1_s))
    return own.frequency_hz, ring_errors(trial.time_s, lateral, weight, own)[0]


def _spectrum(time_s: np.ndarray, lateral_m: np.ndarray, rest_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(b,) Hz and (b, k) amplitudes under the falling half of a Hann window: a decay is strongest at its start."""
    step = float(np.median(np.diff(time_s)))
    even_s = np.arange(0.0, time_s[-1] + step / 2, step)
    swing = np.zeros((len(even_s), lateral_m.shape[1]))
    for k, series in enumerate(lateral_m.T):
        if (seen := np.isfinite(series)).any():
            swing[:, k] = np.interp(even_s, time_s[seen], series[seen]) - rest_m[k]
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


def _ring_flags(time_s: np.ndarray, ring: DampedSine, hz_se: float) -> list[Flag]:
    flags = []
    periods = ring.frequency_hz * float(time_s[-1])
    if periods < FEWEST_PERIODS:
        message = f"only {periods:.1f} periods are recorded after the release; expected at least {FEWEST_PERIODS:g}"
        flags.append(Flag("too_short", message=message))
    elif not hz_se < LEAST_SE * ring.frequency_hz:
        message = f"the frequency is known to {100 * hz_se / ring.frequency_hz:.0f} % only (standard error)"
        flags.append(Flag("unidentifiable", message=message))
    if ring.damping_ratio > NO_RING:
        message = f"the tail creeps back instead of ringing (damping ratio {ring.damping_ratio:.2f}): no frequency"
        flags.append(Flag("unidentifiable", message=message))
    return flags


def _peak_flags(bins_hz: np.ndarray, rms: np.ndarray) -> list[Flag]:
    peaks, _ = find_peaks(rms, height=SECOND_PEAK * rms.max(), prominence=PEAK_PROMINENCE * rms.max())
    if len(peaks) < 2:
        return []
    both = " and ".join(f"{bins_hz[peak]:.2f} Hz" for peak in peaks[:2])
    message = f"the spectrum has peaks at {both}: the robot is touched, the clamp gives, or two swings are mixed"
    return [Flag("double_peaked", message=message)]


def _marker_flags(
    markers: tuple[str, ...], marker_hz: np.ndarray, se_hz: np.ndarray, hz: float, hz_se: float
) -> list[Flag]:
    flags = []
    for name, own, se in zip(markers, marker_hz, se_hz, strict=True):
        off = abs(own - hz)
        if off > DISAGREE * hz and not off <= DISAGREE_SE * np.hypot(se, hz_se):
            message = f"{name} rings at {own:.3f} Hz, all markers together at {hz:.3f} Hz"
            flags.append(Flag("markers_disagree", (name,), message=message))
    return flags
