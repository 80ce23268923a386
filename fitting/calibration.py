"""Calibration of a session: every trial beside the calibrated twin, and their scores.

`calibrate` fits the coefficients to the fit trials (`fitting.coefficient_fit`), fits elongated body theory to the same
trials, compares every trial with the twin and forecasts it; `calibrate_at` makes a `Calibration` from coefficients that
are known. `calibrate_as_published` runs the published search instead (`fitting.published`), for comparison.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fitting.baselines import (
    SpeedLaw,
    SpeedSweep,
    speed_law,
    speed_line,
    speed_power_law,
    sweep_frequencies,
    sweep_speed,
)
from fitting.coefficient_fit import CoefficientFit, fit_coefficients
from fitting.ebt import FORMS, EbtFit, Sway, fit_every_form, model_speeds, noise_flags, sways
from fitting.forecast import diverges
from fitting.left_out import (
    divergence_reason,
    extrapolation_reason,
    far_from_twin_flags,
    followed_trials,
    left_out_flags,
)
from fitting.mode import Mode
from fitting.phase import Scores, fit_phase, forecast, score
from fitting.progress import Progress, part_of
from fitting.published import PublishedFit, Swims, published_search
from fitting.session_forecast import NOTHING_FORECAST, TWIN, Forecast, SessionForecast, forecast_session
from fitting.structure import Structure, uncertainties_of
from fitting.trial import MeasuredTrial
from swimcal.errors import NotEnoughData, SimulationDiverged
from swimcal.flags import Flag
from swimcal.mjcf import FluidCoefficients
from swimcal.robot import RobotSpec
from swimcal.twin import Twin
from tracking.head_frame import HeadFrame


@dataclass(frozen=True, eq=False)
class CalibratedTrial:
    """One trial and the calibrated twin's simulation of it.

    Attributes:
        measured: the trial.
        simulated: (n, m, 2) the twin's head frame at the same times.
        phase_rad: crank phase at time 0.
        simulated_hz: frequency the twin was driven with (held-out trials: from their known part only).
        scores: marker distances over the scored frames.
        speeds: forward speed over the kept whole beats by every model, m/s, see `fitting.ebt.model_speeds`.
        flags: flags of tracks and frequency, and of this comparison.
    """

    measured: MeasuredTrial
    simulated: HeadFrame
    phase_rad: float
    simulated_hz: float
    scores: Scores
    speeds: Mapping[str, float]
    flags: tuple[Flag, ...]

    def __repr__(self) -> str:
        trial = f"{self.measured.name}: {self.measured.role}, {self.measured.frequency.hz:.3f} Hz"
        speeds = f"{1000 * self.measured.speed:.1f} mm/s, twin {1000 * self.speed_twin:.1f} mm/s"
        return f"<CalibratedTrial {trial}, {speeds}, markers {1000 * self.scores.marker_error_m:.1f} mm off>"

    @property
    def speed_twin(self) -> float:
        """Forward speed of the twin, m/s."""
        return self.speeds["twin"]

    @property
    def speed_ebt(self) -> float:
        """Forward speed by elongated body theory as published, m/s."""
        return self.speeds["published"]


@dataclass(frozen=True)
class Summary:
    """Means over the trials of one role: marker distance (mm) and absolute speed errors (m/s).

    Attributes:
        marker_error_mm: mean marker distance of the twin.
        speed_mae_twin, speed_mae_ebt: mean absolute speed error of the twin, and of elongated body theory as published.
        speed_mae: mean absolute speed error of the twin, of each form of elongated body theory, and of each form from
            the twin's tail ("<form>, twin's tail").
        trials: number of trials.
        compared: number of trials behind the speed errors: those whose tail tip elongated body theory sees; all where
            it sees none.
    """

    marker_error_mm: float
    speed_mae_twin: float
    speed_mae_ebt: float
    speed_mae: Mapping[str, float]
    trials: int
    compared: int


@dataclass(frozen=True, eq=False)
class Calibration:
    """A calibrated twin with its scores.

    Attributes:
        structure: structure with which the swims were fitted.
        fit: the coefficients and how they were found.
        ebts: elongated body theory in its forms, each fitted to the same fit trials, by name.
        trials: all swims, in the order of the session.
        sweep: simulated speed over frequency.
        forecasts: forecasts of every trial by the hierarchical model, and by simple baselines.
        sways: sway of the neck in every trial, by its name.
        left_out: the swims that take no part, by name and why.
    """

    structure: Structure
    fit: CoefficientFit
    ebts: Mapping[str, EbtFit]
    trials: tuple[CalibratedTrial, ...]
    sweep: SpeedSweep
    forecasts: SessionForecast
    sways: Mapping[str, Sway] = field(default_factory=dict)
    left_out: Mapping[str, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        return f"<Calibration: {len(self.trials)} trials; {self.coefficients}>"

    @property
    def robot(self) -> RobotSpec:
        """Robot with the fitted structure."""
        return self.structure.robot

    @property
    def coefficients(self) -> FluidCoefficients:
        """Recommended values of the five coefficients."""
        return self.fit.coefficients

    @property
    def ebt(self) -> EbtFit:
        """Fit of elongated body theory as published."""
        return self.ebts["published"]

    @property
    def flags(self) -> tuple[Flag, ...]:
        """Flags of the fit as a whole, those of its structure first."""
        return (*left_out_flags(self.left_out), *self.structure.flags, *self.fit.flags, *self.ebt.flags)

    @property
    def speed_law(self) -> SpeedLaw | None:
        """Exponent of speed over frequency for trials, twin, theory and baselines; None for a single frequency."""
        trials = [trial.measured for trial in self.trials]
        fitted = [trial for trial in trials if trial.role == "fit"]
        hz, speed = [each.frequency.hz for each in fitted], [each.speed for each in fitted]
        at = [trial.frequency.hz for trial in trials]
        models = {name: [trial.speeds[name] for trial in self.trials] for name in ("twin", "published", "large")}
        models |= {"line": speed_line(hz, speed, at), "power_law": speed_power_law(hz, speed, at)}
        return speed_law(trials, models)

    def summary(self, role: str) -> Summary | None:
        """Return the mean errors over the fit or the held-out trials; None when there are none."""
        return summarise([trial for trial in self.trials if trial.measured.role == role])


def summarise(trials: Sequence[CalibratedTrial]) -> Summary | None:
    """Return the mean errors over some trials; None when there are none."""
    if not trials:
        return None
    compared = [t for t in trials if np.isfinite(list(t.speeds.values())).all()] or trials
    errors = np.abs([[speed - t.measured.speed for speed in t.speeds.values()] for t in compared]).mean(axis=0)
    speed_mae = dict(zip(trials[0].speeds, map(float, errors), strict=True))
    error_mm = 1000.0 * float(np.mean([t.scores.marker_error_m for t in trials]))
    return Summary(error_mm, speed_mae["twin"], speed_mae["published"], speed_mae, len(trials), len(compared))


def calibrate(
    trials: Sequence[MeasuredTrial],
    structure: Structure,
    starts: int = 3,
    seed: int = 0,
    workers: int = 0,
    progress: Progress = lambda _message, _share: None,
    left_out: Mapping[str, str] | None = None,
) -> Calibration:
    """Fit the coefficients and elongated body theory on the fit trials, then compare and forecast every trial.

    Args:
        trials: all swims, fit and held-out.
        structure: structure of the robot, see `fitting.structure.assumed` where only its description is known.
        starts: number of starts of the search for the coefficients.
        seed: seed of the search.
        workers: threads; 0 for all cores.
        progress: takes messages with the share of the work that is done.
        left_out: swims that could not be measured, by name and why.

    Raises:
        NotEnoughData: no fit trial, or none that a twin can swim.
        SimulationDiverged: the twin diverged from every start, or at the end.
    """
    _check_fit_trials(trials)
    twin = Twin(structure.robot, trials[0].markers, workers=workers)
    fitted, lost = followed_trials([trial for trial in trials if trial.role == "fit"], twin)
    fit, mode = fit_coefficients(
        fitted, twin, uncertainties_of(structure.sources), starts, seed, part_of(progress, 0.0, 0.8)
    )
    structure = structure.with_time_step(fit.time_step_s)
    twin = Twin(structure.robot, trials[0].markers, workers=workers)
    progress("simulating the trials", 0.8)
    lost |= _diverging(mode, trials)
    able = [trial for trial in trials if trial.name not in lost]
    found = calibrate_at(able, twin, fit, {}, structure, left_out={**(left_out or {}), **lost})
    compared = [trial.measured for trial in found.trials]
    progress("forecasting the trials", 0.9)
    forecasts = forecast_session(mode, compared, seed)
    forecasts = forecasts.with_models({t.measured.name: _alone(t) for t in found.trials})
    return replace(found, forecasts=forecasts, sways=sways(mode, compared))


def _diverging(mode: Mode, trials: Sequence[MeasuredTrial]) -> dict[str, str]:
    """Return by name why held-out trials, of frequencies near enough to the fitted ones, cannot be forecast."""
    fitted_hz = _fitted_hz([trial for trial in trials if trial.role == "fit"])
    at = {trial.name: (trial, trial.start_frequency.hz) for trial in trials if trial.role != "fit"}
    near = {name: pair for name, pair in at.items() if not extrapolation_reason(pair[1], fitted_hz)}
    return {name: divergence_reason(hz) for name, (trial, hz) in near.items() if diverges(mode, trial)}


def calibrate_as_published(
    trials: Sequence[MeasuredTrial],
    structure: Structure,
    budget_s: float,
    seed: int = 0,
    workers: int = 0,
    progress: Progress = lambda _message, _share: None,
) -> tuple[PublishedFit, tuple[CalibratedTrial, ...]]:
    """Run the published search on the fit trials, and compare every trial with the twin that results.

    Args:
        trials: all swims, fit and held-out.
        structure: structure of the robot.
        budget_s: simulated seconds that the search may take.
        seed: seed of the search.
        workers: threads; 0 for all cores.
        progress: takes messages with the share of the work that is done.

    Raises:
        NotEnoughData: no fit trial.
        SimulationDiverged: the twin diverged from every start, or at the end.
    """
    _check_fit_trials(trials)
    twin = Twin(structure.robot, trials[0].markers, workers=workers)
    fitted = tuple(trial for trial in trials if trial.role == "fit")

    def report(share: float, best_m: float) -> None:
        progress(f"searching as published, {1000 * best_m:.1f} mm so far", share)

    fit = published_search(Swims(twin, fitted), budget_s, seed, report)
    phases = dict(zip([trial.name for trial in fitted], fit.phase_rad, strict=True))
    return fit, compare_trials(trials, twin, fit.coefficients, phases, fit_every_form(fitted, structure.robot))[0]


def calibrate_at(
    trials: Sequence[MeasuredTrial],
    twin: Twin,
    fit: CoefficientFit,
    phases: Mapping[str, float],
    structure: Structure,
    forecasts: SessionForecast = NOTHING_FORECAST,
    sways_of: Mapping[str, Sway] | None = None,
    left_out: Mapping[str, str] | None = None,
) -> Calibration:
    """Compare every trial with a twin of known coefficients.

    Args:
        trials: the trials that take part.
        twin: the twin.
        fit: its coefficients.
        phases: crank phase at time 0, by name; one that is not given is estimated from the known part.
        structure: structure of the robot.
        forecasts: forecasts, where they are known.
        sways_of: sway of the neck by name, where it is known.
        left_out: swims that take no part, by name and why; held-out trials at whose frequency the twin diverges join
            them.
    """
    fitted = [trial for trial in trials if trial.role == "fit"]
    ebts = fit_every_form(fitted, structure.robot)
    compared, lost = compare_trials(trials, twin, fit.coefficients, phases, ebts)
    frequencies = sweep_frequencies([trial.measured.frequency.hz for trial in compared])
    return Calibration(
        structure=structure,
        fit=fit,
        ebts=ebts,
        trials=compared,
        sweep=sweep_speed(twin, fit.coefficients, ebts, frequencies, _fitted_hz(fitted)),
        forecasts=forecasts,
        sways=sways_of or {},
        left_out={**(left_out or {}), **lost},
    )


def compare_trials(
    trials: Sequence[MeasuredTrial],
    twin: Twin,
    coefficients: FluidCoefficients,
    phases: Mapping[str, float],
    ebts: Mapping[str, EbtFit],
) -> tuple[tuple[CalibratedTrial, ...], dict[str, str]]:
    """Compare every trial with the twin at given coefficients.

    Args:
        trials: the trials that take part.
        twin: the twin.
        coefficients: its coefficients.
        phases: crank phase at time 0, by name; one that is not given is estimated from the known part.
        ebts: the forms of elongated body theory, by name.

    Returns:
        The trials, and by name why one is not among them.

    Raises:
        SimulationDiverged: the twins of all fit trials diverged.
    """
    fitted_hz = _fitted_hz([trial for trial in trials if trial.role == "fit"])
    compared, lost = [], {}
    for trial in trials:
        if trial.role != "fit" and (why := extrapolation_reason(trial.start_frequency.hz, fitted_hz)):
            lost[trial.name] = why
            continue
        try:
            known = phases.get(trial.name)
            phase = fit_phase(twin, trial, coefficients) if known is None else float(known)
            compared.append(compare_trial(twin, trial, coefficients, ebts, phase, fitted_hz))
        except SimulationDiverged:
            lost[trial.name] = divergence_reason(trial.start_frequency.hz)
    if not any(trial.measured.role == "fit" for trial in compared):
        names = ", ".join(trial.name for trial in trials if trial.role == "fit")
        raise SimulationDiverged(
            f"the twin diverged with the fitted coefficients in all fit trials ({names}): try a smaller time_step_s in "
            "the robot's file, or add a trial at a lower frequency"
        )
    errors_m = [trial.scores.launch_free_error_m for trial in compared]
    others = [[*errors_m[:number], *errors_m[number + 1 :]] for number in range(len(compared))]
    added = [
        (*far_from_twin_flags(trial, fellows), *noise_flags(trial.measured))
        for trial, fellows in zip(compared, others, strict=True)
    ]
    return tuple(replace(t, flags=(*t.flags, *own)) for t, own in zip(compared, added, strict=True)), lost


def compare_trial(
    twin: Twin,
    trial: MeasuredTrial,
    coefficients: FluidCoefficients,
    ebts: Mapping[str, EbtFit],
    phase_rad: float,
    fitted_hz: tuple[float, float],
) -> CalibratedTrial:
    """Compare one trial with the twin at given coefficients and crank phase.

    Args:
        twin: the twin.
        trial: the trial.
        coefficients: coefficients of the twin.
        ebts: the forms of elongated body theory, by name.
        phase_rad: angle of the crank at time 0.
        fitted_hz: lowest and highest frequency of the fit trials.

    Raises:
        SimulationDiverged: the twin diverged.
    """
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
        speeds=model_speeds(trial, simulated, ebts, twin.robot),
        flags=(*trial.flags, *_flag_extrapolation(trial, fitted_hz)),
    )


def _alone(trial: CalibratedTrial) -> dict[str, Forecast]:
    """Return the forecasts of a trial by the twin, and by elongated body theory from the trial's measured tail."""
    mm = 1000.0
    twin = Forecast(trial.speed_twin, None, mm * trial.scores.marker_error_m, mm * trial.scores.shape_error_m)
    return {TWIN: twin} | {f"ebt_{form.name}": Forecast(trial.speeds[form.name]) for form in FORMS}


def _check_fit_trials(trials: Sequence[MeasuredTrial]) -> None:
    if not any(trial.role == "fit" for trial in trials):
        raise NotEnoughData('no swim has role = "fit"; give at least one trial of session.toml that role')


def _fitted_hz(fitted: Sequence[MeasuredTrial]) -> tuple[float, float]:
    hz = [trial.frequency.hz for trial in fitted]
    return min(hz), max(hz)


def _flag_extrapolation(trial: MeasuredTrial, fitted_hz: tuple[float, float]) -> tuple[Flag, ...]:
    low, high = fitted_hz
    if low * 0.999 <= trial.frequency.hz <= high * 1.001:
        return ()
    fitted = f"{low:.3f} Hz" if low == high else f"{low:.3f} to {high:.3f} Hz"
    message = f"{trial.frequency.hz:.3f} Hz is outside the fitted {fitted}"
    return (Flag("extrapolated", message=message),)
