"""A calibration, or a structure alone, in a few lines for the terminal."""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from fitting import CalibrationResult, Structure
from fitting.marginal import Marginal
from reports.numbers import shown
from session import Flag

if TYPE_CHECKING:
    from fitting.posterior.findings import Findings


def calibration_lines(found: CalibrationResult) -> list[str]:
    """A line a trial, then structure, coefficients, means, and every flag, each once."""
    lines = [f"{'trial':12} {'role':8} {'Hz':>6} {'marker mm':>10} {'speed m/s':>10} {'twin':>8} {'EBT':>8}"]
    for name, trial in found.trials.items():
        speeds = f"{shown(trial.speed_measured, 4):>10} {shown(trial.speed_twin, 4):>8} {shown(trial.speed_ebt, 4):>8}"
        errors = f"{shown(trial.frequency_hz, 3):>6} {shown(trial.marker_error_mm, 1):>10}"
        lines.append(f"{name:12} {trial.role:8} {errors} {speeds}")
    lines += [source.sentence for source in found.structure.values()]
    coefficients = found.coefficients._asdict().items()
    lines.append("coefficients " + ", ".join(f"{name} {value:.3g}" for name, value in coefficients))
    lines += _posterior_lines(found.posterior)
    for role, label in (("fit", "fit trials"), ("holdout", "held out")):
        if (summary := found.summary[role]) is not None:
            lines.append(
                f"{label}: markers {shown(summary.marker_error_mm, 1)} mm, mean speed error "
                f"{shown(summary.speed_mae_twin, 4)} m/s (EBT {shown(summary.speed_mae_ebt, 4)})"
            )
    flags = {name: each.flags for name, each in found.experiments.items()}
    flags |= {name: each.flags for name, each in found.trials.items()}
    return [*lines, *_doubts(flags), *(f"! {flag.message}" for flag in found.flags)]


def posterior_lines(found: "Findings") -> list[str]:
    """A line a coefficient, and every flag."""
    return [*_posterior_lines(found.marginals), *(f"! {flag.message}" for flag in found.flags)]


def structure_lines(found: Structure) -> list[str]:
    """A line a number of the structure, and every flag: of the experiments, each once, then of the whole."""
    flags = {decay.name: decay.flags for decay in found.decays}
    flags |= {run.name: run.flags for run in (found.crank.trials if found.crank else ())}
    lines = [source.sentence for source in found.sources]
    return [*lines, *_doubts(flags), *(f"! {flag.message}" for flag in found.flags)]


def _doubts(flags: Mapping[str, Iterable[Flag]]) -> list[str]:
    """A line for every flag that these trials raise."""
    doubts: dict[str, list[str]] = {}
    for name, raised in flags.items():
        for flag in raised:
            doubts.setdefault(f"{_place(flag)}{flag.message}", []).append(name)
    return [f"! {', '.join(dict.fromkeys(names))}: {doubt}" for doubt, names in doubts.items()]


def _posterior_lines(marginals: Mapping[str, Marginal]) -> list[str]:
    """A line a coefficient: its 90 % interval, and whether the trials determine it."""
    return [
        f"  {name:13} {shown(one.mean, 3):>6} ± {one.sd:.2g}, 90 % interval {one.q05:.3g} to {one.q95:.3g}"
        f"{'' if one.determined else ': not determined by these trials'}"
        for name, one in marginals.items()
    ]


def _place(flag: Flag) -> str:
    """Kind and frames of a flag of the tracks; nothing for one that concerns a whole trial."""
    return "" if flag.frames is None else f"frames {flag.frames[0]} to {flag.frames[1]}, {flag.kind}: "
