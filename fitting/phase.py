"""The crank phase that brings the twin's tail in step with a measured one."""

import numpy as np

from fitting.swim import swim
from fitting.trial import MeasuredTrial
from swimmer import Twin

SETTLED_S = 0.25  # the tail has forgotten its start by then
BEATS_IN_STEP = 3.0


def frames_in_step(trial: MeasuredTrial) -> slice:
    """The frames that set a trial's crank phase: of its known part, after the start is forgotten, three beats."""
    end = SETTLED_S + BEATS_IN_STEP / trial.start_frequency.hz
    frames = np.flatnonzero(trial.known & (trial.time_s > SETTLED_S) & (trial.time_s <= end))
    return slice(int(frames[0]), int(frames[-1]) + 1)


def phase_from_harmonic(twin: Twin, trial: MeasuredTrial, coefficients: np.ndarray, frequency_hz: float) -> np.ndarray:
    """Crank phases at time 0 that bring the twin's tail in step with the measured one.

    One simulation at phase 0 tells how far the tail's first harmonic, over the angle of the crank, lags behind it.

    Args:
        twin, trial, frequency_hz: as for `swim`.
        coefficients: (s, 5).

    Returns:
        (s,) rad.
    """
    frames = frames_in_step(trial)
    simulated = swim(twin, trial, coefficients, np.zeros(len(coefficients)), frequency_hz, frames.stop)
    tail = list(trial.tail)
    turn = np.exp(-1j * trial.crank_rad(trial.time_s[frames], frequency_hz))[:, None]
    weight = trial.weight[frames][:, tail]  # (k, t)

    def harmonic(shape_m: np.ndarray) -> np.ndarray:
        lateral = np.nan_to_num(shape_m[..., frames, tail, 1])  # (..., k, t)
        mean = (weight * lateral).sum(axis=-2, keepdims=True) / np.maximum(weight.sum(axis=0), 1e-12)
        return (weight * (lateral - mean) * turn).sum(axis=-2)

    measured, modelled = harmonic(trial.head.shape_m), harmonic(simulated.shape_m)
    return np.angle((measured * modelled.conj()).sum(axis=-1))
