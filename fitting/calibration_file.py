"""`results/calibration.json`: the calibration in the form of the public contract, and back."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from fitting.calibration import CalibratedTrial, Calibration, Summary
from fitting.coefficient_fit import NAMES, CoefficientFit, Restart
from fitting.command_forecast import CommandForecast, forecast_from_command
from fitting.ebt import FORMS, FROM_TWIN
from fitting.objective import Comparison
from fitting.structure import Source, Structure
from session import Flag
from swimmer import FluidCoefficients

MILLIMETRES = 1000.0


def calibration_payload(calibration: Calibration) -> dict[str, Any]:
    """Everything of `calibration.json` but its provenance; what is not known yet is None."""
    fit, foretold = calibration.fit, forecast_from_command(calibration)
    return {
        "coefficients": calibration.coefficients._asdict(),
        "hinge_stiffness": calibration.robot.tail.hinge_stiffness_n_m,
        "crank_arm_m": calibration.robot.crank.arm_m,
        "structure": {source.quantity: _source(source) for source in calibration.structure.sources},
        "experiments": _experiments(calibration.structure),
        "trials": {
            trial.measured.name: _trial(trial) | {"from_command": _foretold(foretold.get(trial.measured.name))}
            for trial in calibration.trials
        },
        "ebt": {
            "beta": calibration.ebt.beta,
            "drag_coefficient": calibration.ebt.drag_coefficient,
            "forms": {name: ebt.drag_coefficient / ebt.beta for name, ebt in calibration.ebts.items()},
        },
        "summary": {role: _summary(calibration.summary(role)) for role in ("fit", "holdout")},
        "flags": [flag.to_json() for flag in calibration.flags],
        "fit": {
            "mean_distance_mm": fit.mean_distance_m * MILLIMETRES,
            "evaluations": fit.evaluations,
            "seconds": round(fit.seconds, 2),
            "method": fit.method,
            "objective": calibration.objective,
            "in_the_middle": fit.in_the_middle,
            "interval95": None if fit.interval is None else dict(zip(NAMES, fit.interval.tolist(), strict=True)),
            "simulated_s": round(fit.spent_s, 1),
            "trace": [[round(spent, 1), MILLIMETRES * best] for spent, best in fit.trace],
            "restarts": [_restart(restart) for restart in fit.restarts],
            "flags": [flag.to_json() for flag in fit.flags],
        },
    }


def _source(source: Source) -> dict[str, Any]:
    return {
        "value": source.value,
        "unit": source.unit,
        "se": source.se,
        "trials": list(source.trials),
        "assumed": source.assumed,
        "sentence": source.sentence,
    }


def _experiments(structure: Structure) -> dict[str, Any]:
    """The dry experiments by name: kind, whether the structure was taken from them, doubts."""
    used = {name for source in structure.sources for name in source.trials}
    decays = {fit.name: ("free_decay", fit.flags) for fit in structure.decays}
    runs = {trial.name: ("dry", trial.flags) for trial in (structure.crank.trials if structure.crank else ())}
    return {
        name: {"kind": kind, "used": name in used, "flags": [flag.to_json() for flag in flags]}
        for name, (kind, flags) in (decays | runs).items()
    }


def _trial(trial: CalibratedTrial) -> dict[str, Any]:
    measured, scores = trial.measured, trial.scores
    return {
        "role": measured.role,
        "commanded_hz": measured.commanded_hz,
        "frequency_hz": measured.frequency.hz,
        "frequency_se_hz": measured.frequency.se_hz,
        "simulated_hz": trial.simulated_hz,
        "phase_rad": trial.phase_rad,
        "marker_error_mm": scores.marker_error_m * MILLIMETRES,
        "marker_error_all_mm": scores.marker_error_all_m * MILLIMETRES,
        "shape_error_mm": scores.shape_error_m * MILLIMETRES,
        "used_fraction": scores.used_fraction,
        "speed_measured": measured.speed,
        "speed_twin": trial.speed_twin,
        "speed_ebt": trial.speed_ebt,
        "speed_ebt_large": trial.speeds["large"],
        "speed_ebt_smoothed": trial.speeds["smoothed"],
        "speed_ebt_of_twin": {form.name: trial.speeds[form.name + FROM_TWIN] for form in FORMS},
        "head_displacement": measured.head.displacement,
        "flags": [flag.to_json() for flag in trial.flags],
    }


def _foretold(forecast: CommandForecast | None) -> dict[str, Any] | None:
    """None for a fit trial, which needs no forecast."""
    if forecast is None:
        return None
    return {
        "frequency_hz": forecast.frequency_hz,
        "speeds": dict(forecast.speeds),
        "flags": [flag.to_json() for flag in forecast.flags],
    }


def _summary(summary: Summary | None) -> dict[str, Any] | None:
    if summary is None:
        return None
    return {
        "marker_error_mm": summary.marker_error_m * MILLIMETRES,
        "speed_mae_twin": summary.speed_mae_twin,
        "speed_mae_ebt": summary.speed_mae_ebt,
        "speed_mae": dict(summary.speed_mae),
    }


def _restart(restart: Restart) -> dict[str, Any]:
    return {
        "start": restart.start.tolist(),
        "coefficients": restart.coefficients.tolist(),
        "phase_rad": restart.phase_rad.tolist(),
        "objective_mm": restart.objective_m * MILLIMETRES,
        "history_mm": (restart.history_m * MILLIMETRES).tolist(),
        "converged": restart.converged,
        "swims_forward": restart.swims_forward,
    }


def read_fit(data: Mapping[str, Any]) -> tuple[CoefficientFit, dict[str, float]]:
    """The coefficient fit in a `calibration.json`, and the crank phase (rad) of each trial by name."""
    phases = {name: trial["phase_rad"] for name, trial in data["trials"].items()}
    fitted = [name for name, trial in data["trials"].items() if trial["role"] == "fit"]
    fit = data["fit"]
    return CoefficientFit(
        coefficients=FluidCoefficients(**data["coefficients"]),
        phase_rad=np.array([phases[name] for name in fitted]),
        mean_distance_m=fit["mean_distance_mm"] / MILLIMETRES,
        restarts=tuple(_read_restart(restart) for restart in fit["restarts"]),
        evaluations=fit["evaluations"],
        seconds=fit["seconds"],
        flags=tuple(map(Flag.from_json, fit["flags"])),
        method=fit["method"],
        spent_s=fit["simulated_s"],
        trace=tuple((spent, best / MILLIMETRES) for spent, best in fit["trace"]),
        interval=None if (found := fit.get("interval95")) is None else np.array([found[name] for name in NAMES]),
        in_the_middle=fit.get("in_the_middle", False),
    ), phases


def read_objective(data: Mapping[str, Any]) -> Comparison:
    """What the fit in a `calibration.json` minimised."""
    objective: Comparison = data["fit"].get("objective", "published")
    return objective


def _read_restart(data: Mapping[str, Any]) -> Restart:
    return Restart(
        start=np.array(data["start"]),
        coefficients=np.array(data["coefficients"]),
        phase_rad=np.array(data["phase_rad"]),
        objective_m=data["objective_mm"] / MILLIMETRES,
        history_m=np.array(data["history_mm"]) / MILLIMETRES,
        converged=data["converged"],
        swims_forward=data["swims_forward"],
    )
