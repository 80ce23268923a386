"""A `diagnosis.json` in three sentences and a table for the terminal."""

from collections.abc import Mapping, Sequence
from typing import Any

from diagnosis.sentences import sentences

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
