"""The page of the documentation lists the catalogue as it is."""

from pathlib import Path

import pytest

from swimmer.effects import Effect, catalogue

PAGE = Path(__file__).parents[3] / "docs" / "effects.md"


def row(effect: Effect) -> str:
    """Of the table: name, what it is, what is fitted of it, how it enters."""
    parameters = ", ".join(f"{p.name} {p.low:g} to {p.high:g}{_unit(p.unit)} ({p.sd:g})" for p in _told(effect))
    ways = ", ".join(way.replace("_", " ") for way in effect.enters())
    return f"| `{effect.name}` | {effect.physics} | {parameters} | {ways} | {effect.stage} |"


def _told(effect: Effect) -> tuple:  # type: ignore[type-arg]
    """Of effects with parameters for each marker, those of one."""
    return effect.parameters if len(effect.parameters) < 8 else effect.parameters[:2]


def _unit(unit: str) -> str:
    return "" if unit == "1" else f" {unit}"


@pytest.mark.parametrize("effect", catalogue().values(), ids=lambda effect: effect.name)
def test_every_effect_has_its_row(effect: Effect) -> None:
    assert row(effect) in PAGE.read_text().splitlines()
