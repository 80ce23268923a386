"""The first identification from end to end: measured swims in, a calibrated twin with its scores out."""

from dataclasses import dataclass

import numpy as np

from fitting.coefficients import FULL, CoefficientFit, Effort, Progress, fit_coefficients
from fitting.ebt import EbtFit, fit_ebt, measured_tail_motion
from fitting.forecast import fit_phase, forecast
from fitting.objective import Swims
from fitting.scoring import Scores, score
from fitting.speed import forward_speed
from fitting.sweep import SpeedSweep, sweep_frequencies, sweep_speed
from fitting.trial import MeasuredTrial
from session import Flag, NotEnoughData, SimulationDiverged
from swimmer import FluidCoefficients, RobotSpec, Twin
from tracking import HeadFrame


@dataclass(frozen=True, eq=False)
class CalibratedTrial:
    """One trial beside the calibrated twin.

    Attributes:
        measured: as measured.
        simulated: (n, m, 2) the twin's head frame at the same times.
        phase_rad: crank phase at time 0.
        simulated_hz: frequency the twin was driven with (held-out trials: from their known part only).
        scores: marker distances over the scored frames.
        speed_twin, speed_ebt: forward speed over the kept whole beats, m/s; EBT from the measured tail.
        flags: of tracks and frequency, and of this comparison.
    """

    measured: MeasuredTrial
    simulated: HeadFrame
    phase_rad: float
    simulated_hz: float
    scores: Scores
    speed_twin: float
    speed_ebt: float
    flags: tuple[Flag, ...]


@dataclass(frozen=True)
class Summary:
    """Means over the trials of one role: marker distance (m) and absolute speed errors (m/s)."""

    marker_error_m: float
    speed_mae_twin: float
    speed_mae_ebt: float


@dataclass(frozen=True, eq=False)
class Calibration:
    """A calibrated twin and how well it does.

    Attributes:
        robot: with the structure that was used.
        fit: the coefficients and how they were found.
        ebt: elongated body theory on the same fit trials.
        trials: all swims, in the order of the session.
        sweep: simulated speed over frequency.
    """

    robot: RobotSpec
    fit: CoefficientFit
    ebt: EbtFit
    trials: tuple[CalibratedTrial, ...]
    sweep: SpeedSweep

    @property
    def coefficients(self) -> FluidCoefficients:
        """The five coefficients."""
        return self.fit.coefficients

    @property
    def flags(self) -> tuple[Flag, ...]:
        """Of the fit as a whole."""
        return (*self.fit.flags, *self.ebt.flags)

    def summary(self, role: str) -> Summary | None:
        """Means over the fit or the held-out trials; None when there are none."""
        chosen = [t for t in self.trials if t.measured.role == role]
        if not chosen:
            return None
        measured = np.array([t.measured.speed for t in chosen])
        return Summary(
            marker_error_m=float(np.mean([t.scores.marker_error_m for t in chosen])),
            speed_mae_twin=float(np.mean(np.abs(np.array([t.speed_twin for t in chosen]) - measured))),
            speed_mae_ebt=float(np.mean(np.abs(np.array([t.speed_ebt for t in chosen]) - measured))),
        )


def calibrate(
    trials: list[MeasuredTrial],
    robot: RobotSpec,
    effort: Effort = FULL,
    seed: int = 0,
    workers: int = 0,
    progress: Progress | None = None,
) -> Calibration:
    """Fits the coefficients and elongated body theory on the fit trials, then compares every trial.

    Args:
        trials: all swims, fit and held-out.
        robot: the robot.
        effort: how hard to search.
        seed: of the search.
        workers: threads; 0 for all cores.
        progress: see `fit_coefficients`.

    Raises:
        NotEnoughData: no fit trial.
    """
    fitted = [trial for trial in trials if trial.role == "fit"]
    if not fitted:
        raise NotEnoughData('no swim has role = "fit"; give at least one trial of session.toml that role')
    twin = Twin(robot, trials[0].markers, workers=workers)
    fit = fit_coefficients(Swims(twin, tuple(fitted)), effort, seed, progress)
    phases = dict(zip([t.name for t in fitted], fit.phase_rad, strict=True))
    return assemble(trials, twin, fit, phases)


def assemble(trials: list[MeasuredTrial], twin: Twin, fit: CoefficientFit, phases: dict[str, float]) -> Calibration:
    """Every trial beside a twin whose coefficients are known.

    Args:
        trials: all swims.
        twin: with their markers.
        fit: the coefficients.
        phases: crank phase of each trial by name; those that are missing are found from the trial's known part.
    """
    robot = twin.robot
    fitted = [trial for trial in trials if trial.role == "fit"]
    motions = [measured_tail_motion(trial, robot, trial.kept) for trial in fitted]
    ebt = fit_ebt(motions, np.array([trial.speed for trial in fitted]), robot)
    fitted_hz = (min(t.frequency.hz for t in fitted), max(t.frequency.hz for t in fitted))
    compared = []
    for trial in trials:
        known = phases.get(trial.name)
        phase = fit_phase(twin, trial, fit.coefficients) if known is None else float(known)
        compared.append(_compare(twin, trial, fit.coefficients, ebt, phase, fitted_hz))
    frequencies = sweep_frequencies([trial.frequency.hz for trial in trials])
    return Calibration(
        robot=robot,
        fit=fit,
        ebt=ebt,
        trials=tuple(compared),
        sweep=sweep_speed(twin, fit.coefficients, ebt, frequencies, fitted_hz),
    )


def _compare(
    twin: Twin,
    trial: MeasuredTrial,
    coefficients: FluidCoefficients,
    ebt: EbtFit,
    phase_rad: float,
    fitted_hz: tuple[float, float],
) -> CalibratedTrial:
    hz = trial.start_frequency.hz
    simulated = forecast(twin, trial, coefficients, phase_rad, hz)
    if not np.isfinite(simulated.path_m).all():
        raise SimulationDiverged(f"trial {trial.name}: the twin diverged with the fitted coefficients at {hz:.3g} Hz")
    return CalibratedTrial(
        measured=trial,
        simulated=simulated,
        phase_rad=phase_rad,
        simulated_hz=hz,
        scores=score(trial, simulated),
        speed_twin=float(forward_speed(trial.time_s, simulated.forward_m, trial.kept, trial.frequency.hz)),
        speed_ebt=float(ebt.speed(measured_tail_motion(trial, twin.robot, trial.kept), twin.robot)),
        flags=(*trial.flags, *_extrapolated(trial, fitted_hz)),
    )


def _extrapolated(trial: MeasuredTrial, fitted_hz: tuple[float, float]) -> tuple[Flag, ...]:
    low, high = fitted_hz
    if low * 0.999 <= trial.frequency.hz <= high * 1.001:
        return ()
    message = f"{trial.frequency.hz:.3f} Hz lies outside the fitted {low:.3f} to {high:.3f} Hz"
    return (Flag("extrapolated", message=message),)
