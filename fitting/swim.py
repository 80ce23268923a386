"""Simulations of measured trials: started as the trial started, read off at its frames, in its head frame."""

import numpy as np

from fitting.in_pool import head_frame
from fitting.trial import MeasuredTrial
from swimmer import Runs, Twin
from tracking import HeadFrame


def swim(
    twin: Twin,
    trial: MeasuredTrial,
    coefficients: np.ndarray,
    phase_rad: np.ndarray,
    frequency_hz: float,
    frames: int | None = None,
) -> HeadFrame:
    """Head frames (s, n, m, 2) of s simulations of one trial, started with its own velocity.

    Args:
        twin: with the trial's markers.
        trial: n frames.
        coefficients: (s, 5).
        phase_rad: (s,) crank angle at time 0.
        frequency_hz: of the crank, for all; a trial with a measured turn makes that instead.
        frames: only so many from the first; default all n.
    """
    count = len(phase_rad)
    runs = Runs(
        coefficients=np.ascontiguousarray(coefficients),
        frequency_hz=np.full(count, frequency_hz),
        phase_rad=np.asarray(phase_rad, float),
        velocity=np.tile(trial.start_velocity, (count, 1)),
        turns=(trial.turn,) * count,
    )
    trajectories = twin.simulate(runs, trial.time_s[:frames], allow_divergence=True)
    return head_frame(trial.markers, trajectories.marker_m)
