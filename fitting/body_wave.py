"""The wave along the body, the dimensionless numbers of the swim, and the neck's sway, each measured and simulated."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fitting.model.features import FeatureReader, harmonics_of, of_markers
from fitting.model.mode import Mode
from fitting.model.roll import NO_ROLL
from fitting.series import design, weighted_fit
from fitting.speed import forward_speed
from fitting.trial import MeasuredTrial
from swimmer import RobotSpec
from tracking import HeadFrame
from tracking.normaliser import from_head_frame


class BodyWave(NamedTuple):
    """First harmonic of the lateral motion of each tail marker, in the head frame.

    Attributes:
        markers: names of the t tail markers, from head to fin.
        amplitude_m: (t,) m.
        lag_rad: (t,) phase by which each lags behind the first, in (-pi, pi].
    """

    markers: tuple[str, ...]
    amplitude_m: np.ndarray
    lag_rad: np.ndarray


class SwimNumbers(NamedTuple):
    """Dimensionless numbers (Gazzola, Argentina and Mahadevan, Nature Physics 10 (2014)) of a swim after its warm-up.

    The role of a trial changes none of them: U and A are those of the whole swim, not of the rest that is scored.

    Attributes:
        amplitude_m: A, half the excursion of the hindmost marker in the pool, peak to peak, m.
        swimming_number: Sw = omega A L / nu, L the body length.
        reynolds: Re = U L / nu.
        strouhal: St = f 2 A / U; nan when the robot does not swim forward.
    """

    amplitude_m: float
    swimming_number: float
    reynolds: float
    strouhal: float


def body_wave(trial: MeasuredTrial, head: HeadFrame) -> BodyWave:
    """Return the body wave of a trial over its kept frames.

    Args:
        trial: n frames of m markers.
        head: (n, m, 2) the head frame of the trial itself, or of a simulation of it.
    """
    tail = list(trial.tail)
    frames = trial.kept
    lateral = head.shape_m[frames][:, tail, 1]  # (k, t)
    weight = np.where(np.isfinite(lateral), (trial.weight[frames][:, tail] > 0).astype(float), 0.0)
    columns = design(trial.time_s[frames], trial.frequency.hz, harmonics=3)
    fitted = weighted_fit(columns, lateral, weight)
    first = fitted[2] - 1j * fitted[3]  # (t,) complex amplitude: lateral = Re(first exp(i omega t))
    lag = np.angle(first[0] * first.conj())
    return BodyWave(tuple(trial.markers[i] for i in tail), np.abs(first), lag)


def excursion(reader: FeatureReader, position_m: np.ndarray, marker: int) -> float:
    """Measure how far a marker swings across the course of the fish in the pool, peak to peak.

    The course is smooth: a path cubic in time, along a heading quadratic in time. The head's own sway and yaw count, as
    in the literature on Strouhal numbers: in the head's frame the tail of this fish swings about twice as far.

    Args:
        reader: reader of the frames that count.
        position_m: (n, m, 2) markers in these frames, on the pool, m.
        marker: index of the marker.

    Returns:
        Twice the amplitude of its first harmonic, m.
    """
    return 2 * float(abs(harmonics_of(reader(position_m))[marker, 1, 0]))


def swim_numbers(trial: MeasuredTrial, robot: RobotSpec) -> SwimNumbers:
    """Compute the dimensionless numbers of a measured swim."""
    whole = trial.with_role("fit")
    wide = excursion(FeatureReader.of(whole), whole.position_m[whole.kept], whole.hindmost)
    return _numbers(wide / 2, trial.frequency.hz, whole.speed, robot)


def simulated_numbers(trial: MeasuredTrial, head: HeadFrame, frequency_hz: float, robot: RobotSpec) -> SwimNumbers:
    """Compute the dimensionless numbers of a simulation of a trial.

    Args:
        trial: the trial, n frames.
        head: (n, m, 2) head frame of the simulation.
        frequency_hz: turns of the simulated crank a second.
        robot: the robot.
    """
    whole = trial.with_role("fit")
    reader = FeatureReader.of(whole)
    turn_rad = trial.crank_rad(reader.time_s, frequency_hz)
    everything = replace(reader, turn_rad=turn_rad, usable=np.ones_like(reader.usable))
    wide = excursion(everything, from_head_frame(head)[whole.kept], whole.hindmost)
    speed = float(forward_speed(trial.time_s, head, whole.kept, frequency_hz))
    return _numbers(wide / 2, frequency_hz, speed, robot)


def _numbers(amplitude: float, frequency_hz: float, speed: float, robot: RobotSpec) -> SwimNumbers:
    viscosity = robot.water.viscosity_pa_s / robot.water.density_kg_m3  # nu, m^2/s
    return SwimNumbers(
        amplitude_m=amplitude,
        swimming_number=2 * np.pi * frequency_hz * amplitude * robot.length_m / viscosity if viscosity > 0 else np.nan,
        reynolds=speed * robot.length_m / viscosity if viscosity > 0 else np.nan,
        strouhal=2 * amplitude * frequency_hz / speed if speed > 0 else np.nan,
    )


class Wave(NamedTuple):
    """First harmonic of a marker's sideways motion; phase ahead of the hindmost marker seen, 0 to 360 degrees."""

    amplitude_m: float
    phase_deg: float


class Sway(NamedTuple):
    """Sway of the neck in one trial.

    Attributes:
        frequency_hz: beats a second.
        measured: sway by the tracks.
        rigid: sway of the calibrated twin, whose hull does not roll.
        rolling: sway of the same twin with the likeliest roll of the fit.
        roll_deg: amplitude of that roll.
    """

    frequency_hz: float
    measured: Wave
    rigid: Wave
    rolling: Wave
    roll_deg: float


def sways(mode: Mode, trials: Sequence[MeasuredTrial]) -> dict[str, Sway]:
    """Return the neck's sway in every trial, fitted or held out, by its name.

    Args:
        mode: the fit.
        trials: the trials.
    """
    first, found = mode.model.trials[0], {}
    for trial in trials:
        neck, hindmost = trial.markers.index("neck"), trial.hindmost
        model = type(first)(first.twin, trial, first.phase_rad, with_course=True, roll=mode.roll)
        swum = model.trajectories(mode.coefficients[None])
        rows = [model.measured, *(each.features_of(swum)[0] for each in (model.rolling(NO_ROLL), model))]
        harmonics = [of_markers(row)[:, 1, 1] + 1j * of_markers(row)[:, 1, 2] for row in rows]  # (m,) each
        roll = abs(harmonics[2][neck] - harmonics[1][neck]) / first.twin.robot.marker_positions_m(("neck",))[0, 2]
        measured, rigid, rolling = (_wave(each[neck], each[hindmost]) for each in harmonics)
        found[trial.name] = Sway(trial.frequency.hz, measured, rigid, rolling, float(np.degrees(roll)))
    return found


def _wave(harmonic: complex, reference: complex) -> Wave:
    phase = np.degrees(np.angle(harmonic / reference)) % 360
    return Wave(float(abs(harmonic)), float(phase))
