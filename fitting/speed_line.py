"""The baseline that every forecast of a speed has to beat: a straight line in frequency through the fitted trials."""

from collections.abc import Mapping

import numpy as np

from fitting.calibration_file import TrialResult


def speed_line(trials: Mapping[str, TrialResult]) -> dict[str, float]:
    """Speeds of all trials by a straight line in frequency, m/s, by trial; empty without a fit trial.

    The line goes through the measured speeds of the fit trials; of one alone through the origin. A held-out trial is
    forecast at the frequency of its first two beats, as the twin is.

    Args:
        trials: of a calibration.
    """
    fitted = [trial for trial in trials.values() if trial.role == "fit"]
    if not fitted:
        return {}
    hz = np.array([trial.frequency_hz for trial in fitted])
    speed = np.array([trial.speed_measured for trial in fitted])
    if np.ptp(hz) > 0:
        slope, constant = np.polyfit(hz, speed, 1)
    else:
        slope, constant = float(np.mean(speed / hz)), 0.0
    return {name: float(constant + slope * trial.simulated_hz) for name, trial in trials.items()}
