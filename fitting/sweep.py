"""Frequency sweep: the speed at which the calibrated twin settles, and that by elongated body theory."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fitting.ebt import EbtFit, simulated_tail
from fitting.in_pool import head_frame, tail_markers
from fitting.speed import forward_speed
from swimmer import FluidCoefficients, Runs, Twin
from tracking import one_of

BEATS = 14.0  # length of a swim in beats
SETTLING_BEATS = 6.0  # beats in which it settles
LEAST_S = 8.0  # least length of a swim
START_SPEED_M_S = 0.10  # at low frequency the twin has two steady states; started forward it finds the forward one
FRAME_S = 1 / 60


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
        speed_twin[i] = forward_speed(time_s, one_of(head, i), kept, hz)
        if np.isfinite(speed_twin[i]):
            swim = simulated_tail(time_s, one_of(head, i), tail, kept, hz)
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
