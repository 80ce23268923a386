"""Baselines of the speed over frequency, the law of the speed, and the sweep on which all are shown.

`BASELINES` are the simple rules, in frequency alone, that a forecast has to beat. `speed_law` fits a power of the
frequency to the measured speeds of a session and to those of every model. `sweep_speed` simulates the calibrated twin
at evenly spaced frequencies, settled, beside elongated body theory.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.stats import t as student

from fitting.ebt import EbtFit, simulated_tail
from fitting.pool import forward_speed, head_frame, tail_markers
from fitting.trial import MeasuredTrial
from swimcal.mjcf import FluidCoefficients
from swimcal.runs import Runs
from swimcal.twin import Twin
from tracking.head_frame import select_head

# The law of the speed
LEVEL = 0.9  # level of the interval of a slope
_FEWEST = 3  # trials that tell a slope with its interval
SAME_BEAT = 0.02
"""Largest relative difference of beat frequencies that count as one."""

# The sweep
BEATS = 14.0  # length of a swim in beats
SETTLING_BEATS = 6.0  # beats in which it settles
LEAST_S = 8.0  # least length of a swim
START_SPEED_M_S = 0.10  # at low frequency the twin has two steady states; started forward it finds the forward one
FRAME_S = 1 / 60  # time between two frames


class Slope(NamedTuple):
    """Slope of a straight line through points, by least squares, with Student's 90 % interval; None for two points."""

    value: float
    interval: tuple[float, float] | None


@dataclass(frozen=True)
class SpeedLaw:
    """Law of the speed over all swim trials of a session, fitted and held out.

    Attributes:
        exponents: exponent of the speed over the frequency, by "measured" and the names of models.
        residual: slope of ln(measured speed / twin's) with ln frequency: 0 where the twin has the right law.
    """

    exponents: Mapping[str, Slope]
    residual: Slope | None

    @property
    def sentence(self) -> str:
        """Sentence on the twin's law of the speed."""
        if self.residual is None or self.residual.interval is None:
            return "Fewer than three trials swim forward: they say nothing of the law of the speed."
        low, high = self.residual.interval
        if low <= 0 <= high:
            return "The twin's speed grows with the frequency as the measured one, within the scatter of the trials."
        if self.residual.value > 0:
            return (
                "The measured speed grows more steeply with the frequency than the twin's. Possible causes: drag that "
                "grows less than with the squared speed (skin friction, a cable in tow), or a loss of thrust at slow "
                "beats."
            )
        return (
            "The measured speed grows less with the frequency than the twin's. Possible causes: drag that grows more "
            "than with the squared speed (waves), or a tail that yields or a motor that slows down at fast beats."
        )


def speed_law(trials: Sequence[MeasuredTrial], models: Mapping[str, Sequence[float]]) -> SpeedLaw | None:
    """Fit the law of some trials; None where fewer than two of different frequencies swim forward.

    Args:
        trials: the trials.
        models: speed of each trial by each model, m/s, by the model's name.
    """
    forward = np.array([trial.speed > 0 for trial in trials], bool)
    swims = [trial for trial, swam in zip(trials, forward, strict=True) if swam]
    hz = np.array([trial.frequency.hz for trial in swims])
    if len(swims) < 2 or not _tell_a_slope(hz.tolist()):
        return None
    speed, ln_hz = np.array([trial.speed for trial in swims]), np.log(hz)
    found = {name: np.array(each, float)[forward] for name, each in models.items()}
    found = {name: each for name, each in found.items() if (each > 0).all()}
    exponents = {"measured": slope(ln_hz, np.log(speed))}
    exponents |= {name: slope(ln_hz, np.log(each)) for name, each in found.items()}
    residual = np.log(speed / found["twin"]) if "twin" in found else None
    return SpeedLaw(exponents, None if residual is None else slope(ln_hz, residual))


def slope(x: np.ndarray, y: np.ndarray) -> Slope:
    """Return the slope of y (n,) over x (n,), at least two points."""
    off = x - x.mean()
    value = float(off @ y / (off @ off))
    if len(x) < _FEWEST:
        return Slope(value, None)
    residual = y - y.mean() - value * off
    freedom = len(x) - 2
    reach = float(student.ppf(0.5 + LEVEL / 2, freedom) * np.sqrt(residual @ residual / freedom / (off @ off)))
    return Slope(value, (value - reach, value + reach))


@dataclass(frozen=True, eq=False)
class SpeedSweep:
    """Simulated speed over frequency.

    Attributes:
        frequency_hz: (f,) frequencies of the crank.
        speed_twin: (f,) forward speed of the twin, m/s; nan where it diverged.
        ebt: (f,) speed by each form of elongated body theory for the twin's own tail motion, m/s, by the form's name.
        fitted_hz: lowest and highest frequency of the fit trials; outside the curves are extrapolated.
    """

    frequency_hz: np.ndarray
    speed_twin: np.ndarray
    ebt: Mapping[str, np.ndarray]
    fitted_hz: tuple[float, float]

    @property
    def speed_ebt(self) -> np.ndarray:
        """Speed by elongated body theory as published, (f,), m/s."""
        return self.ebt["published"]

    def at(self, hz: float) -> dict[str, float]:
        """Interpolate the speed (m/s) at a frequency, by "twin" and the names of `ebt`; nan beyond the sweep."""
        curves = {"twin": self.speed_twin, **self.ebt}
        beyond = {"left": np.nan, "right": np.nan}
        return {name: float(np.interp(hz, self.frequency_hz, curve, **beyond)) for name, curve in curves.items()}


def sweep_speed(
    twin: Twin,
    coefficients: FluidCoefficients,
    ebts: Mapping[str, EbtFit],
    frequency_hz: np.ndarray,
    fitted_hz: tuple[float, float],
) -> SpeedSweep:
    """Simulate one long swim at each frequency, all in one batch.

    Args:
        twin: the twin.
        coefficients: its coefficients.
        ebts: the forms of elongated body theory, by name.
        frequency_hz: (f,) frequencies of the crank.
        fitted_hz: lowest and highest frequency of the fit trials.
    """
    count = len(frequency_hz)
    seconds = np.maximum(BEATS / frequency_hz, LEAST_S)
    time_s = np.arange(0.0, seconds.max(), FRAME_S)
    runs = Runs(
        coefficients=np.tile(coefficients, (count, 1)).astype(float),
        frequency_hz=frequency_hz,
        phase_rad=np.zeros(count),
        velocity=np.tile([-START_SPEED_M_S, 0.0, 0.0], (count, 1)),
    )
    until = np.minimum(time_s, seconds[:, None])  # the last frame of a run comes again and again
    markers = twin.simulate(runs, until, allow_divergence=True).marker_m
    head = head_frame(twin.markers, markers)
    tail = tail_markers(twin.robot, twin.markers)
    speed_twin = np.full(count, np.nan)
    speeds = {name: np.full(count, np.nan) for name in ebts}
    for i, hz in enumerate(frequency_hz):
        kept = (time_s >= SETTLING_BEATS / hz) & (time_s < seconds[i])
        speed_twin[i] = forward_speed(time_s, select_head(head, i), kept, hz)
        if np.isfinite(speed_twin[i]):
            swim = simulated_tail(time_s, select_head(head, i), tail, kept, hz)
            for name, ebt in ebts.items():
                speeds[name][i] = ebt.speed(swim, twin.robot)
    return SpeedSweep(frequency_hz, speed_twin, speeds, fitted_hz)


def sweep_frequencies(measured_hz: list[float], count: int = 25) -> np.ndarray:
    """Return frequencies from a little below the slowest trial to a little above the fastest, Hz.

    Args:
        measured_hz: frequencies of the trials.
        count: number of frequencies.
    """
    return np.linspace(0.85 * min(measured_hz), 1.15 * max(measured_hz), count)


def speed_line(fitted_hz: Sequence[float], fitted_speed: Sequence[float], hz: Sequence[float]) -> list[float]:
    """Return the speeds by a straight line in frequency through the fitted trials, m/s; nan without any.

    If all trials have about one frequency the line goes through the origin: the stride is constant. A held-out trial
    is forecast at the frequency of its first two beats, as by the twin.

    Args:
        fitted_hz: (n,) measured beat frequencies, Hz.
        fitted_speed: (n,) forward speeds, m/s.
        hz: (k,) frequencies of the forecasts.
    """
    if not _tell_a_slope(fitted_hz):
        return speed_constant_stride(fitted_hz, fitted_speed, hz)
    slope, constant = np.polyfit(fitted_hz, fitted_speed, 1)
    return [float(constant + slope * each) for each in hz]


def _tell_a_slope(fitted_hz: Sequence[float]) -> bool:
    """Tell whether the frequencies differ by so much that their speeds tell a slope."""
    return len(fitted_hz) > 0 and bool(np.ptp(fitted_hz) > SAME_BEAT * np.mean(fitted_hz))


def speed_power_law(fitted_hz: Sequence[float], fitted_speed: Sequence[float], hz: Sequence[float]) -> list[float]:
    """Return the speeds by a power of the frequency through the fitted trials, m/s.

    They are nan where a fitted trial did not swim forward. If all have about one frequency the stride is constant.

    Args:
        fitted_hz: (n,) measured beat frequencies, Hz.
        fitted_speed: (n,) forward speeds, m/s.
        hz: (k,) frequencies of the forecasts.
    """
    if not len(fitted_speed) or (np.array(fitted_speed) <= 0).any():
        return [float("nan")] * len(hz)
    if not _tell_a_slope(fitted_hz):
        return speed_constant_stride(fitted_hz, fitted_speed, hz)
    power, constant = np.polyfit(np.log(fitted_hz), np.log(fitted_speed), 1)
    return list(map(float, np.exp(constant) * np.array(hz, float) ** power))


def speed_constant_stride(
    fitted_hz: Sequence[float], fitted_speed: Sequence[float], hz: Sequence[float]
) -> list[float]:
    """Return the speeds in proportion to the frequency, by the mean distance a beat, m/s.

    Args:
        fitted_hz: (n,) measured beat frequencies, Hz.
        fitted_speed: (n,) forward speeds, m/s.
        hz: (k,) frequencies of the forecasts.
    """
    if not len(fitted_hz):
        return [float("nan")] * len(hz)
    stride = float(np.mean(np.array(fitted_speed) / np.array(fitted_hz)))
    return [stride * each for each in hz]


class Baseline(NamedTuple):
    """Simple rule of the speed over frequency, with the words by which a reader knows it."""

    rule: Callable[[Sequence[float], Sequence[float], Sequence[float]], list[float]]
    label: str


BASELINES = {
    "line": Baseline(speed_line, "line in frequency"),
    "power_law": Baseline(speed_power_law, "power law in frequency"),
    "constant_stride": Baseline(speed_constant_stride, "constant stride"),
}
"""Simple rules that every forecast of a speed has to beat, by name."""
