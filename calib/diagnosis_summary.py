"""A `diagnosis.json` in three sentences and a table for the terminal."""

from collections.abc import Mapping, Sequence
from typing import Any

from diagnosis.sentences import plain, sentences

_ROWS = 6


def diagnosis_lines(data: Mapping[str, Any]) -> list[str]:
    """Where, which and how far; then the likeliest effects, and what to measure next."""
    lines = [*sentences(data), ""]
    chances = {name: p for name, p in data["probabilities"].items() if name != "none_of_these"}
    lines.append(f"{'effect':28} {'probability':>11}  fitted")
    for name, chance in list(chances.items())[:_ROWS]:
        lines.append(f"{name:28} {chance:11.3f}  {_fitted(data['effect_parameters'].get(name))}".rstrip())
    lines.append(f"{'none of these':28} {data['probabilities']['none_of_these']:11.3f}")
    lines.append(f"{'nothing at all':28} {data['no_gap_probability']:11.3f}")
    lines += [f"next: {each['describe']}" for each in data["next_experiments"][:3]]
    return [*lines, *(f"model: {name}" for name in data.get("models", ()))]


def supposition_lines(data: Mapping[str, Any]) -> list[str]:
    """What speaks for each supposed effect and for all together; then the gap without and with them."""
    factor = data["log_bayes_factor"]
    lines = [
        f"Supposed: {', '.join(plain(name) for name in data['effects'])}.",
        f"The fitted swims are e^{factor:.1f} times as probable with {'it' if len(data['effects']) == 1 else 'them'} "
        "as with the plain twin, whatever else may be amiss.",
        "",
        f"{'effect':28} {'ln factor':>11}  fitted",
    ]
    for name, own in data["log_bayes_factor_of_each"].items():
        lines.append(f"{name:28} {own:11.1f}  {_fitted(data['effect_parameters'].get(name))}".rstrip())
    lines += ["", f"{'':28} {'plain':>11} {'supposed':>11}"]
    for swims, gap in (("fitted", data["fitted"]), ("held out", data["gap"])):
        if gap["evaluated_on"]:
            lines.append(_beside(f"{swims}: markers, mm", gap["baseline_mm"], gap["with_effects_mm"]))
            placed = gap["baseline_placed_mm"], gap["with_effects_placed_mm"]
            lines.append(_beside(f"{swims}: boxes put right, mm", *placed))
            speeds = gap["speed_mae_before"], gap["speed_mae_after"]
            lines.append(_beside(f"{swims}: speed, mm/s", *(1000 * each for each in speeds)))
    if data["gap"].get("shrinkage") is not None:
        low, high = data["gap"]["shrinkage_ci95"]
        lines.append(f"The held-out gap shrinks by {data['gap']['shrinkage']:.0%} ({low:.0%} to {high:.0%}).")
    return lines


def _beside(what: str, before: float | None, after: float | None) -> str:
    return f"{what:28} " + " ".join(f"{'-' if each is None else f'{each:.1f}':>11}" for each in (before, after))


def _fitted(parameters: Mapping[str, Any] | None) -> str:
    if parameters is None:
        return ""
    named = {parameters["parameter"]: parameters} if "value" in parameters else parameters
    shown = sorted(named.items(), key=lambda item: -_clear(item[1]["value"], item[1]["ci95"]))[:3]
    return ", ".join(
        f"{name} {p['value']:.3g} ({p['ci95'][0]:.2g} to {p['ci95'][1]:.2g}) {p['unit']}" for name, p in shown
    )


def _clear(value: float, interval: Sequence[float]) -> float:
    """How many half intervals it is from zero."""
    return abs(value) / max(interval[1] - interval[0], 1e-12)
