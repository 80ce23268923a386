"""Records of a calibration: `results/calibration.json`, in the form of the public contract, and `published.json`.

Beside the fit, `calibration.json` holds forecasts from the command alone (`forecast_from_command`). For these the beat
is the command times the mean ratio of beat to command over the fit trials; the speed is the one at which the calibrated
twin settles at that beat (see `fitting.baselines`). The forecast of `fitting.phase` knows more: a held-out trial's
frequency, phase and start from its own first beats.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from fitting.baselines import SpeedLaw
from fitting.calibration import CalibratedTrial, Calibration, Summary, summarise
from fitting.coefficient_fit import CoefficientFit, Marginal
from fitting.ebt import FROM_TWIN, Sway
from fitting.left_out import FAR
from fitting.published import PublishedFit
from fitting.session_forecast import SessionForecast
from fitting.structure import Source, Structure
from fitting.trial_checks import TAIL_FIRST
from swimcal.flags import Flag
from swimcal.mjcf import FluidCoefficients
from swimcal.results import ResultFile

_PER_M = 1000.0  # mm


# Forecasts from the command alone.


class CommandForecast(NamedTuple):
    """Forecast of one held-out trial from its command.

    Attributes:
        frequency_hz: beat frequency; nan where no command is known.
        speeds: m/s by the model's name, as in `fitting.ebt.model_speeds`: the twin and elongated body theory from the
            twin's tail; nan where the frequency is not known, or is outside the sweep.
        flags: why there is no speed.
    """

    frequency_hz: float
    speeds: Mapping[str, float]
    flags: tuple[Flag, ...]


def forecast_from_command(calibration: Calibration) -> dict[str, CommandForecast]:
    """Forecast every held-out trial from its command, by its name."""
    ratio = beat_to_command(calibration)
    held_out = (trial.measured for trial in calibration.trials if trial.measured.role != "fit")
    return {trial.name: _forecast(calibration, ratio, trial.commanded_hz) for trial in held_out}


def beat_to_command(calibration: Calibration) -> float:
    """Return the mean ratio of beat to command over the fit trials; nan where no command is known."""
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


# The records.


@dataclass(frozen=True)
class TrialResult:
    """One trial and the calibrated twin; speeds in m/s, forward positive (see `CalibratedTrial`).

    Attributes:
        role: "fit" or "holdout".
        commanded_hz: crank turns a second that were commanded; null where not known.
        frequency_hz, frequency_se_hz: measured beat frequency with its standard error.
        simulated_hz: crank frequency that the twin was driven with.
        phase_rad: angle of the crank at time 0.
        marker_error_mm, marker_error_all_mm, shape_error_mm: distances as the public contract defines them.
        used_fraction: share of the samples that count.
        metres_per_px: scale of the picture, of the session or of this trial.
        speed_measured, speed_twin: speed of the robot and of the twin.
        speed_ebt, speed_ebt_large, speed_ebt_smoothed: speed by three forms of elongated body theory from the measured
            tail.
        flags: flags of the trial.
        from_command: forecast from the command; null for a fit trial.
    """

    role: str
    commanded_hz: float | None
    frequency_hz: float
    frequency_se_hz: float
    simulated_hz: float
    phase_rad: float
    marker_error_mm: float
    marker_error_all_mm: float
    shape_error_mm: float
    used_fraction: float
    metres_per_px: float
    speed_measured: float
    speed_twin: float
    speed_ebt: float
    speed_ebt_large: float
    speed_ebt_smoothed: float
    flags: tuple[Flag, ...]
    from_command: CommandForecast | None

    def __repr__(self) -> str:
        speeds = f"{_PER_M * self.speed_measured:.1f} mm/s, twin {_PER_M * self.speed_twin:.1f} mm/s"
        markers = f"markers {self.marker_error_mm:.1f} mm off"
        return f"<TrialResult: {self.role}, {self.frequency_hz:.3f} Hz, {speeds}, {markers}>"


@dataclass(frozen=True)
class Experiment:
    """A dry experiment: its kind, whether the structure was taken from it, its flags."""

    kind: str
    used: bool
    flags: tuple[Flag, ...]


@dataclass(frozen=True)
class EbtResult:
    """Elongated body theory as published."""

    beta: float
    drag_coefficient: float


@dataclass(frozen=True)
class CalibrationResult:
    """The content of `calibration.json`.

    Attributes:
        coefficients: the five fluid coefficients.
        hinge_stiffness: stiffness of every hinge, N m/rad.
        crank_arm_m: crank arm on either side.
        structure: where hinge stiffness, hinge damping and crank arm come from.
        experiments: dry runs and free decays by name.
        trials: swim trials by name.
        ebt: fitted numbers of elongated body theory.
        summary: mean errors by role; null where no trial has the role.
        flags: flags of the fit as a whole.
        fit: how the coefficients were found, with intervals and variance components.
        forecasts: every swim trial forecast by the model and by simple baselines.
        speed_law: exponent of speed over frequency, of robot and twin; null for a single frequency.
        sways: sideways sway of the neck in every trial.
        posterior: marginal posterior of each coefficient; empty before `calib posterior`.
        left_out: why, by name, of swim trials that take no part.
    """

    coefficients: FluidCoefficients
    hinge_stiffness: float
    crank_arm_m: float
    structure: Mapping[str, Source]
    experiments: Mapping[str, Experiment]
    trials: Mapping[str, TrialResult]
    ebt: EbtResult
    summary: Mapping[str, Summary | None]
    flags: tuple[Flag, ...]
    fit: CoefficientFit
    forecasts: SessionForecast
    speed_law: SpeedLaw | None
    sways: Mapping[str, Sway]
    posterior: Mapping[str, Marginal] = field(default_factory=dict)
    left_out: Mapping[str, str] = field(default_factory=dict)

    @property
    def fitted_hz(self) -> tuple[float, float]:
        """Lowest and highest beat frequency of the fit trials, Hz."""
        hz = [trial.frequency_hz for trial in self.trials.values() if trial.role == "fit"]
        return min(hz), max(hz)

    @property
    def standing_flags(self) -> tuple[Flag, ...]:
        """Flags of the fit as a whole, less those that a posterior replaces.

        A posterior says which coefficients are determined.
        """
        return tuple(flag for flag in self.flags if not (self.posterior and flag.kind == "unidentifiable"))


CALIBRATION = ResultFile("calibration.json", CalibrationResult)


def doubted_trials(found: CalibrationResult) -> tuple[str, ...]:
    """Return the names of fitted trials that their twin cannot follow, so that no effect explains them."""
    return tuple(
        name
        for name, trial in found.trials.items()
        if trial.role == "fit" and any(flag.kind in (FAR, TAIL_FIRST) for flag in trial.flags)
    )


def calibration_result(calibration: Calibration) -> CalibrationResult:
    """Convert a calibration into its record."""
    forecasts = forecast_from_command(calibration)
    return CalibrationResult(
        coefficients=calibration.coefficients,
        hinge_stiffness=calibration.robot.tail.hinge_stiffness_n_m,
        crank_arm_m=calibration.robot.crank.arm_m,
        structure={source.quantity: source for source in calibration.structure.sources},
        experiments=_experiments(calibration.structure),
        trials={t.measured.name: _trial(t, forecasts.get(t.measured.name)) for t in calibration.trials},
        ebt=EbtResult(beta=calibration.ebt.beta, drag_coefficient=calibration.ebt.drag_coefficient),
        summary={role: calibration.summary(role) for role in ("fit", "holdout")},
        flags=calibration.flags,
        fit=calibration.fit,
        forecasts=calibration.forecasts,
        speed_law=calibration.speed_law,
        sways=calibration.sways,
        left_out=calibration.left_out,
    )


@dataclass(frozen=True)
class PublishedResult:
    """The content of `published.json`: what the published objective and search lead to, for comparison.

    Attributes:
        fit: coefficients, and how they were found.
        summary: mean errors by role; null where no trial has the role.
        trials: swim trials by name; without forecasts from the command.
    """

    fit: PublishedFit
    summary: Mapping[str, Summary | None]
    trials: Mapping[str, TrialResult]


PUBLISHED = ResultFile("published.json", PublishedResult)


def published_result(fit: PublishedFit, trials: tuple[CalibratedTrial, ...]) -> PublishedResult:
    """Convert a published search into its record."""
    summary = {role: summarise([t for t in trials if t.measured.role == role]) for role in ("fit", "holdout")}
    return PublishedResult(fit, summary, {t.measured.name: _trial(t, None) for t in trials})


def _experiments(structure: Structure) -> dict[str, Experiment]:
    used = {name for source in structure.sources for name in source.trials}
    decays = {fit.name: ("free_decay", fit.flags) for fit in structure.decays}
    runs = {trial.name: ("dry", trial.flags) for trial in (structure.crank.trials if structure.crank else ())}
    return {name: Experiment(kind, name in used, flags) for name, (kind, flags) in (decays | runs).items()}


def _trial(trial: CalibratedTrial, forecast: CommandForecast | None) -> TrialResult:
    measured, scores = trial.measured, trial.scores
    return TrialResult(
        role=measured.role,
        commanded_hz=measured.commanded_hz,
        frequency_hz=measured.frequency.hz,
        frequency_se_hz=measured.frequency.se_hz,
        simulated_hz=trial.simulated_hz,
        phase_rad=trial.phase_rad,
        marker_error_mm=_PER_M * scores.marker_error_m,
        marker_error_all_mm=_PER_M * scores.marker_error_all_m,
        shape_error_mm=_PER_M * scores.shape_error_m,
        used_fraction=scores.used_fraction,
        metres_per_px=measured.metres_per_px,
        speed_measured=measured.speed,
        speed_twin=trial.speed_twin,
        speed_ebt=trial.speed_ebt,
        speed_ebt_large=trial.speeds["large"],
        speed_ebt_smoothed=trial.speeds["smoothed"],
        flags=trial.flags,
        from_command=forecast,
    )
