"""Speeds forecast from the command alone, with nothing that was measured in the trial itself.

The beat is the command times the mean ratio of beat to command over the fit trials; the speed is the one at which the
calibrated twin settles at that beat (see `fitting.sweep`). The forecast of `fitting.forecast` knows more: a held-out
trial's frequency, phase and start from its own first beats.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from fitting.calibration import Calibration
from fitting.ebt import FROM_TWIN
from session import Flag


class CommandForecast(NamedTuple):
    """The forecast of one held-out trial.

    Attributes:
        frequency_hz: of its beat; nan where no command is known.
        speeds: m/s by the model's name, as in `fitting.ebt.model_speeds`: the twin and elongated body theory from the
            twin's tail; nan where the frequency is not known, or is outside the sweep.
        flags: why there is no speed.
    """

    frequency_hz: float
    speeds: Mapping[str, float]
    flags: tuple[Flag, ...]


def forecast_from_command(calibration: Calibration) -> dict[str, CommandForecast]:
    """The forecast of every held-out trial by its name."""
    ratio = beat_to_command(calibration)
    held_out = (trial.measured for trial in calibration.trials if trial.measured.role != "fit")
    return {trial.name: _forecast(calibration, ratio, trial.commanded_hz) for trial in held_out}


def beat_to_command(calibration: Calibration) -> float:
    """Mean ratio of beat to command over the fit trials; nan where the command of none is known."""
    fitted = (trial.measured for trial in calibration.trials if trial.measured.role == "fit")
    ratios = [trial.frequency.hz / trial.commanded_hz for trial in fitted if trial.commanded_hz]
    return float(np.mean(ratios)) if ratios else float("nan")


def _forecast(calibration: Calibration, ratio: float, commanded_hz: float | None) -> CommandForecast:
    hz = ratio * (commanded_hz or np.nan)
    speeds = {name if name == "twin" else name + FROM_TWIN: v for name, v in calibration.sweep.at(hz).items()}
    return CommandForecast(hz, speeds, _flags(calibration.sweep.frequency_hz, ratio, hz))


def _flags(swept_hz: np.ndarray, ratio: float, hz: float) -> tuple[Flag, ...]:
    if not np.isfinite(hz):
        whose = "its command" if np.isfinite(ratio) else "the command of every fit trial"
        return (Flag("no_command", message=f"{whose} is not known, so its beat cannot be forecast from the command"),)
    low, high = float(swept_hz.min()), float(swept_hz.max())
    if low <= hz <= high:
        return ()
    message = f"{hz:.3f} Hz, forecast from the command, is outside the {low:.3f} to {high:.3f} Hz of the sweep"
    return (Flag("extrapolated", message=message),)
