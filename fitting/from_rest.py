"""Does a calibrated twin swim forward from rest, as the robot does?

MuJoCo's fluid model has two steady states for many sets of coefficients: started at the measured speed such a twin
follows the trials, started from rest it settles swimming backward. No trial that begins mid-swim can
separate them, but the robot itself does: it starts from rest.
"""

import numpy as np

from fitting.in_pool import head_frame
from fitting.speed import forward_speed
from fitting.trial import MeasuredTrial
from swimmer import Runs, Twin

BEATS = 4.0  # simulated, of which the second half counts; with 6, 4 of 512 twins are told apart otherwise
FRAME_S = 1 / 30


def probed_hz(trials: tuple[MeasuredTrial, ...]) -> float:
    """Half the slowest of the trials: of 512 twins all over the box, those that swim forward at it do at all faster."""
    return 0.5 * min(trial.frequency.hz for trial in trials)


def seconds_from_rest(trials: tuple[MeasuredTrial, ...]) -> float:
    """Seconds simulated to check one set of coefficients."""
    return BEATS / probed_hz(trials)


def speed_from_rest(twin: Twin, coefficients: np.ndarray, frequency_hz: np.ndarray) -> np.ndarray:
    """(s, f) forward speed after half of some beats from rest, m/s, for s sets of coefficients (s, 5)."""
    sets, hz = len(coefficients), np.tile(frequency_hz, len(coefficients))
    runs = Runs(np.repeat(np.asarray(coefficients, float), len(frequency_hz), axis=0), hz, np.zeros(len(hz)))
    times = [np.arange(0.0, BEATS / f, FRAME_S) for f in frequency_hz]
    longest = max(map(len, times))
    padded = np.tile([np.pad(t, (0, longest - len(t)), mode="edge") for t in times], (sets, 1))
    marker_m = twin.simulate(runs, padded, allow_divergence=True).marker_m
    marker_m = marker_m.reshape(sets, len(times), longest, *marker_m.shape[2:])
    speeds = np.zeros((sets, len(times)))
    for i, (f, time_s) in enumerate(zip(frequency_hz, times, strict=True)):
        head = head_frame(twin.markers, marker_m[:, i, : len(time_s)])
        speeds[:, i] = forward_speed(time_s, head.forward_m, time_s >= BEATS / 2 / f, f)
    return speeds


def swims_forward(twin: Twin, coefficients: np.ndarray, trials: tuple[MeasuredTrial, ...]) -> np.ndarray:
    """(s,) whether each set of coefficients (s, 5) swims forward from rest at the frequencies of the trials.

    Always True when a trial itself was measured swimming backward.
    """
    if any(trial.speed <= 0 for trial in trials):
        return np.ones(len(coefficients), bool)
    with np.errstate(invalid="ignore"):
        return np.asarray((speed_from_rest(twin, coefficients, np.array([probed_hz(trials)])) > 0)[:, 0])
