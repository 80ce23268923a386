"""Errors of the predicted speeds over a set of trials, each number with an interval.

The interval is a 90 % percentile bootstrap that draws trials with replacement and, for each, a measurement error of
its speed from the scatter of its beats. With three trials it is wide and says little beyond the trials at hand.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from fitting.calibration import CalibratedTrial
from fitting.speed import speed_standard_error
from fitting.trial import MeasuredTrial

DRAWS = 2000


class Interval(NamedTuple):
    """A number with its 90 % interval, m/s."""

    value: float
    low: float
    high: float


class SpeedErrors(NamedTuple):
    """Mean absolute error, bias (predicted minus measured) and largest absolute error, m/s."""

    mean_absolute: Interval
    bias: Interval
    worst: Interval


def speed_errors(
    trials: Sequence[CalibratedTrial],
    seed: int = 0,
    speeds: Callable[[CalibratedTrial], Mapping[str, float]] = lambda trial: trial.speeds,
) -> dict[str, SpeedErrors]:
    """The errors of every model over the trials, in whatever order, by the model's name; empty without trials.

    Args:
        trials: to be predicted.
        seed: of the draws.
        speeds: what every model says of a trial, m/s, by the model's name.
    """
    if not trials:
        return {}
    trials = sorted(trials, key=lambda trial: trial.measured.name)  # draws go by a trial's place
    random = np.random.default_rng(seed)
    spread = np.nan_to_num([_standard_error(trial.measured) for trial in trials])
    drawn = random.integers(len(trials), size=(DRAWS, len(trials)))
    noise = random.normal(size=drawn.shape) * spread[drawn]
    result = {}
    for name in speeds(trials[0]):
        error = np.array([speeds(trial)[name] - trial.measured.speed for trial in trials])
        draws = error[drawn] - noise
        result[name] = SpeedErrors(
            _interval(np.abs(error).mean(), np.abs(draws).mean(axis=1)),
            _interval(error.mean(), draws.mean(axis=1)),
            _interval(np.abs(error).max(), np.abs(draws).max(axis=1)),
        )
    return result


def _standard_error(trial: MeasuredTrial) -> float:
    return speed_standard_error(trial.time_s, trial.head.forward_m, trial.kept, trial.frequency.hz)


def _interval(value: float, draws: np.ndarray) -> Interval:
    low, high = np.nanpercentile(draws, [5, 95]) if np.isfinite(draws).any() else (np.nan, np.nan)
    return Interval(float(value), float(low), float(high))
