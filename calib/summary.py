"""A `calibration.json` in a few lines for the terminal."""

from collections.abc import Iterable, Mapping
from typing import Any


def calibration_lines(data: Mapping[str, Any]) -> list[str]:
    """A line a trial, then structure, coefficients, means, and every flag: of the trials, each once, then of the fit.

    Args:
        data: the content of `calibration.json`.
    """
    lines = [f"{'trial':12} {'role':8} {'Hz':>6} {'marker mm':>10} {'speed m/s':>10} {'twin':>8} {'EBT':>8}"]
    for name, trial in data["trials"].items():
        numbers = (
            _shown(trial["frequency_hz"], 6, 3),
            _shown(trial["marker_error_mm"], 10, 1),
            _shown(trial["speed_measured"], 10, 4),
            _shown(trial["speed_twin"], 8, 4),
            _shown(trial["speed_ebt"], 8, 4),
        )
        lines.append(f"{name:12} {trial['role']:8} {' '.join(numbers)}")
    lines += [source["sentence"] for source in data["structure"].values()]
    lines.append("coefficients " + ", ".join(f"{name} {value:.3g}" for name, value in data["coefficients"].items()))
    lines += posterior_lines(data.get("posterior") or {})
    for role, label in (("fit", "fit trials"), ("holdout", "held out")):
        if (summary := data["summary"][role]) is not None:
            lines.append(
                f"{label}: markers {_shown(summary['marker_error_mm'], 0, 1)} mm, mean speed error "
                f"{_shown(summary['speed_mae_twin'], 0, 4)} m/s (EBT {_shown(summary['speed_mae_ebt'], 0, 4)})"
            )
    flags = {name: trial["flags"] for name, trial in (data["experiments"] | data["trials"]).items()}
    return [*lines, *_doubts(flags), *(f"! {flag['message']}" for flag in data["flags"])]


def structure_lines(data: Mapping[str, Any]) -> list[str]:
    """A line a number of the structure, and every flag: of the experiments, each once, then of the whole.

    Args:
        data: the content of `structure.json`.
    """
    flags = {decay["name"]: decay["flags"] for decay in data["decays"]}
    flags |= {run["measured"]: run["flags"] for run in (data["crank"] or {"trials": []})["trials"]}
    lines = [source["sentence"] for source in data["sources"]]
    return [*lines, *_doubts(flags), *(f"! {flag['message']}" for flag in data["flags"])]


def _doubts(flags: Mapping[str, Iterable[Mapping[str, Any]]]) -> list[str]:
    """A line for every flag that these trials raise."""
    doubts: dict[str, list[str]] = {}
    for name, raised in flags.items():
        for flag in raised:
            doubts.setdefault(f"{_place(flag)}{flag['message']}", []).append(name)
    return [f"! {', '.join(dict.fromkeys(names))}: {doubt}" for doubt, names in doubts.items()]


def posterior_lines(marginals: Mapping[str, Any]) -> list[str]:
    """A line a coefficient: its 90 % interval, and whether the trials determine it."""
    return [
        f"  {name:13} {_shown(one['mean'], 6, 3)} ± {one['sd']:.2g}, 90 % interval {one['q05']:.3g} to {one['q95']:.3g}"
        f"{'' if one['determined'] else ': not determined by these trials'}"
        for name, one in marginals.items()
    ]


def _place(flag: Mapping[str, Any]) -> str:
    """Kind and frames of a flag of the tracks; nothing for one that concerns a whole trial."""
    return "" if flag["frames"] is None else f"frames {flag['frames'][0]} to {flag['frames'][1]}, {flag['kind']}: "


def _shown(value: float | None, width: int, decimals: int) -> str:
    return f"{'–':>{width}}" if value is None else f"{value:{width}.{decimals}f}"
