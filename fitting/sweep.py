"""The frequency sweep: the speed at which the calibrated twin settles, and what elongated body theory makes of it."""

from dataclasses import dataclass

import numpy as np

from fitting.ebt import EbtFit, tail_motion
from fitting.speed import forward_speed
from fitting.trial import tail_markers
from swimmer import FluidCoefficients, Runs, Twin
from tracking import to_head_frame

BEATS, SETTLING_BEATS, LEAST_S = 14.0, 6.0, 8.0
START_SPEED_M_S = 0.10  # at low frequency the twin has two steady states; started forward it finds the forward one
FRAME_S = 1 / 60


@dataclass(frozen=True, eq=False)
class SpeedSweep:
    """Speed over frequency, simulated.

    Attributes:
        frequency_hz: (f,) of the crank.
        speed_twin: (f,) forward speed of the twin, m/s; nan where it diverged.
        speed_ebt: (f,) of elongated body theory for the twin's own tail motion, m/s.
        fitted_hz: lowest and highest frequency of the fit trials; outside the curves are extrapolated.
    """

    frequency_hz: np.ndarray
    speed_twin: np.ndarray
    speed_ebt: np.ndarray
    fitted_hz: tuple[float, float]


def sweep_speed(
    twin: Twin,
    coefficients: FluidCoefficients,
    ebt: EbtFit,
    frequency_hz: np.ndarray,
    fitted_hz: tuple[float, float],
) -> SpeedSweep:
    """Simulates one long swim a frequency, all in one batch.

    Args:
        twin: of the calibrated robot.
        coefficients: frozen.
        ebt: frozen.
        frequency_hz: (f,).
        fitted_hz: range of the fit trials.
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
    markers = twin.simulate(runs, time_s, allow_divergence=True).marker_m
    head = to_head_frame(markers, twin.markers.index("nose"), twin.markers.index("neck"))
    tail = tail_markers(twin.robot, twin.markers)[-2:]
    speeds = np.full((2, count), np.nan)
    for i, hz in enumerate(frequency_hz):
        kept = (time_s >= SETTLING_BEATS / hz) & (time_s < seconds[i])
        speeds[0, i] = forward_speed(time_s, head.forward_m[i], kept, hz)
        motion = tail_motion(time_s, head.shape_m[i][:, tail], np.ones((len(time_s), 2)), kept, hz)
        speeds[1, i] = ebt.speed(motion, twin.robot)
    return SpeedSweep(frequency_hz, speeds[0], speeds[1], fitted_hz)


def sweep_frequencies(measured_hz: list[float], count: int = 25) -> np.ndarray:
    """(count,) frequencies from a little below the slowest trial to a little above the fastest, Hz."""
    return np.linspace(0.85 * min(measured_hz), 1.15 * max(measured_hz), count)
