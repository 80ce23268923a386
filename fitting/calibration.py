"""The first identification from end to end: measured swims in, a calibrated twin with its scores out."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fitting.coefficient_fit import CoefficientFit
from fitting.coefficients import FULL, Effort, Progress
from fitting.ebt import EbtFit, fit_every_form, speeds_beside
from fitting.forecast import fit_phase, forecast
from fitting.methods import search
from fitting.objective import Comparison, Swims
from fitting.scoring import Scores, score
from fitting.structure import Structure
from fitting.sweep import SpeedSweep, sweep_frequencies, sweep_speed
from fitting.trial import MeasuredTrial
from session import Flag, NotEnoughData
from session.errors import SimulationDiverged
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
        speeds: forward speed over the kept whole beats by every model, m/s, see `fitting.ebt.speeds_beside`.
        flags: of tracks and frequency, and of this comparison.
    """

    measured: MeasuredTrial
    simulated: HeadFrame
    phase_rad: float
    simulated_hz: float
    scores: Scores
    speeds: Mapping[str, float]
    flags: tuple[Flag, ...]

    @property
    def speed_twin(self) -> float:
        """Of the twin, m/s."""
        return self.speeds["twin"]

    @property
    def speed_ebt(self) -> float:
        """By elongated body theory as published, m/s."""
        return self.speeds["published"]


@dataclass(frozen=True)
class Summary:
    """Means over the trials of one role: marker distance (mm) and absolute speed errors (m/s).

    Attributes:
        marker_error_mm: of the twin.
        speed_mae_twin, speed_mae_ebt: of the twin, and of elongated body theory as published.
        speed_mae: one entry for the twin, each form of elongated body theory, and each form from the twin's tail
            ("<form>, twin's tail").
    """

    marker_error_mm: float
    speed_mae_twin: float
    speed_mae_ebt: float
    speed_mae: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class Calibration:
    """A calibrated twin and how well it does.

    Attributes:
        structure: that the swims were fitted with.
        fit: the coefficients and how they were found.
        ebts: elongated body theory in its forms, each fitted to the same fit trials, by name.
        trials: all swims, in the order of the session.
        sweep: simulated speed over frequency.
        objective: what the search minimised, see `Swims`; every distance told here is the published one all the same.
    """

    structure: Structure
    fit: CoefficientFit
    ebts: Mapping[str, EbtFit]
    trials: tuple[CalibratedTrial, ...]
    sweep: SpeedSweep
    objective: Comparison = "published"

    @property
    def robot(self) -> RobotSpec:
        """The robot with the structure that was used."""
        return self.structure.robot

    @property
    def coefficients(self) -> FluidCoefficients:
        """The five coefficients."""
        return self.fit.coefficients

    @property
    def ebt(self) -> EbtFit:
        """Elongated body theory as published."""
        return self.ebts["published"]

    @property
    def flags(self) -> tuple[Flag, ...]:
        """Of the fit as a whole, the structure it builds on first."""
        return (*self.structure.flags, *self.fit.flags, *self.ebt.flags)

    def summary(self, role: str) -> Summary | None:
        """Means over the fit or the held-out trials; None when there are none."""
        chosen = [t for t in self.trials if t.measured.role == role]
        if not chosen:
            return None
        errors = [{name: abs(speed - t.measured.speed) for name, speed in t.speeds.items()} for t in chosen]
        speed_mae = {name: float(np.mean([error[name] for error in errors])) for name in errors[0]}
        error_mm = 1000.0 * float(np.mean([t.scores.marker_error_m for t in chosen]))
        return Summary(error_mm, speed_mae["twin"], speed_mae["published"], speed_mae)


def calibrate(
    trials: list[MeasuredTrial],
    structure: Structure,
    effort: Effort = FULL,
    seed: int = 0,
    workers: int = 0,
    method: str = "gradient",
    comparison: Comparison = "published",
    progress: Progress | None = None,
) -> Calibration:
    """Fits the coefficients and elongated body theory on the fit trials, then compares every trial.

    Args:
        trials: all swims, fit and held-out.
        structure: of the robot, see `fitting.structure.assumed` where only its description is known.
        effort: how hard to search.
        seed: of the search.
        workers: threads; 0 for all cores.
        method: a key of `fitting.methods.METHODS`.
        comparison: what the search minimises, see `Swims`; scores, and the fit's mean distance, are the published
            ones whatever it was.
        progress: see `fit_coefficients`.

    Raises:
        NotEnoughData: no fit trial, or trials without a usable sample; all of them at once.
    """
    _refuse_unusable(trials)
    fitted = [trial for trial in trials if trial.role == "fit"]
    twin = Twin(structure.robot, trials[0].markers, workers=workers)
    swims = Swims(twin, tuple(fitted), comparison)
    fit = search(method, swims, effort, seed, progress=progress)
    if comparison != "published":
        fit = replace(fit, mean_distance_m=_published_distance(replace(swims, comparison="published"), fit))
    phases = dict(zip([t.name for t in fitted], fit.phase_rad, strict=True))
    return assemble(trials, twin, fit, phases, structure, comparison)


def _published_distance(swims: Swims, fit: CoefficientFit) -> float:
    """Of a fit that another objective led to, m."""
    return float(swims.mean_distance(np.append(fit.coefficients, fit.phase_rad)[:, None])[0])


def _refuse_unusable(trials: list[MeasuredTrial]) -> None:
    problems = []
    if not any(trial.role == "fit" for trial in trials):
        problems.append('no swim has role = "fit"; give at least one trial of session.toml that role')
    for trial in trials:
        if not trial.weight[trial.scored].any():
            problems.append(
                f"trial {trial.name}: every sample to be compared is flagged or missing; leave the trial out"
            )
        elif not trial.weight[trial.known][:, list(trial.tail)].any():
            problems.append(f"trial {trial.name}: no usable marker where its phase comes from; leave the trial out")
    if problems:
        raise NotEnoughData("\n".join(problems))


def assemble(
    trials: list[MeasuredTrial],
    twin: Twin,
    fit: CoefficientFit,
    phases: dict[str, float],
    structure: Structure,
    objective: Comparison = "published",
) -> Calibration:
    """Every trial beside a twin whose coefficients are known.

    Args:
        trials: all swims.
        twin: of the structure's robot, with their markers.
        fit: the coefficients.
        phases: crank phase of each trial by name; those that are missing are found from the trial's known part.
        structure: that the coefficients were fitted with.
        objective: that they were found by.
    """
    robot = structure.robot
    fitted = [trial for trial in trials if trial.role == "fit"]
    ebts = fit_every_form(fitted, robot)
    fitted_hz = (min(t.frequency.hz for t in fitted), max(t.frequency.hz for t in fitted))
    compared = []
    for trial in trials:
        known = phases.get(trial.name)
        phase = fit_phase(twin, trial, fit.coefficients) if known is None else float(known)
        compared.append(_compare(twin, trial, fit.coefficients, ebts, phase, fitted_hz))
    frequencies = sweep_frequencies([trial.frequency.hz for trial in trials])
    return Calibration(
        structure=structure,
        fit=fit,
        ebts=ebts,
        trials=tuple(compared),
        sweep=sweep_speed(twin, fit.coefficients, ebts, frequencies, fitted_hz),
        objective=objective,
    )


def _compare(
    twin: Twin,
    trial: MeasuredTrial,
    coefficients: FluidCoefficients,
    ebts: Mapping[str, EbtFit],
    phase_rad: float,
    fitted_hz: tuple[float, float],
) -> CalibratedTrial:
    hz = trial.start_frequency.hz
    simulated = forecast(twin, trial, coefficients, phase_rad)
    if not np.isfinite(simulated.path_m).all():
        raise SimulationDiverged(f"trial {trial.name}: the twin diverged with the fitted coefficients at {hz:.3g} Hz")
    return CalibratedTrial(
        measured=trial,
        simulated=simulated,
        phase_rad=phase_rad,
        simulated_hz=hz,
        scores=score(trial, simulated),
        speeds=speeds_beside(trial, simulated, ebts, twin.robot),
        flags=(*trial.flags, *_extrapolated(trial, fitted_hz)),
    )


def _extrapolated(trial: MeasuredTrial, fitted_hz: tuple[float, float]) -> tuple[Flag, ...]:
    low, high = fitted_hz
    if low * 0.999 <= trial.frequency.hz <= high * 1.001:
        return ()
    message = f"{trial.frequency.hz:.3f} Hz lies outside the fitted {low:.3f} to {high:.3f} Hz"
    return (Flag("extrapolated", message=message),)
