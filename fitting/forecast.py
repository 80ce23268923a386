"""What frozen coefficients say of a trial: its own phase from its own first beats, then the twin runs ahead alone."""

import numpy as np

from fitting.phase import frames_in_step, phase_from_harmonic
from fitting.swim import swim
from fitting.trial import MeasuredTrial
from swimmer import FluidCoefficients, Twin
from tracking import HeadFrame, one_of

_REACH_RAD = 0.6  # the harmonic phase is right to within this
_TRIES = 13


def fit_phase(twin: Twin, trial: MeasuredTrial, coefficients: FluidCoefficients) -> float:
    """Crank phase at time 0, from the shape of the tail in the known part of the trial, rad.

    The harmonic phase is refined twice on a grid, all simulations in one batch.
    """
    hz = trial.start_frequency.hz
    values = np.array([coefficients], float)
    centre = float(phase_from_harmonic(twin, trial, values, hz)[0])
    reach = _REACH_RAD
    frames = frames_in_step(trial)
    for _ in range(3):
        tries = centre + np.linspace(-reach, reach, _TRIES)
        simulated = swim(twin, trial, np.repeat(values, _TRIES, axis=0), tries, hz, frames.stop)
        misfit = _shape_misfit(trial, simulated, frames)
        centre, reach = float(tries[np.argmin(misfit)]), reach / 5
    return centre


def forecast(
    twin: Twin, trial: MeasuredTrial, coefficients: FluidCoefficients, phase_rad: float, frequency_hz: float
) -> HeadFrame:
    """The twin's head frame (n, m, 2) of one trial."""
    values = np.array([coefficients], float)
    return one_of(swim(twin, trial, values, np.array([phase_rad]), frequency_hz), 0)


def _shape_misfit(trial: MeasuredTrial, simulated: HeadFrame, frames: slice) -> np.ndarray:
    """(s,) mean distance of the tail markers relative to the nose over some frames, their mean offset left out."""
    tail = list(trial.tail)
    weight = trial.weight[frames][:, tail]
    error = simulated.shape_m[:, frames][:, :, tail] - trial.head.shape_m[frames][:, tail]  # (s, k, t, 2)
    error = np.nan_to_num(error, nan=1.0)
    share = weight / np.maximum(weight.sum(axis=0), 1e-12)
    error = error - (share[..., None] * error).sum(axis=1, keepdims=True)
    return (weight * np.linalg.norm(error, axis=-1)).sum(axis=(1, 2)) / weight.sum()
