"""Markdown of the catalogue of effects, from the effects themselves."""

from collections.abc import Iterable, Iterator
from itertools import groupby

from swimcal.effects.catalogue import FAMILIES
from swimcal.effects.effect import Effect, Parameter

_TITLES = {
    "measurement": "Camera and tracker",
    "drive": "Clock and drive",
    "tendons": "Tendons",
    "structure": "Structure",
    "fluid": "Fluid and surroundings",
}
_TRIALS = {"swim": "swim trials", "dry": "dry runs", "free_decay": "free decays"}
_MANY = 8  # An effect of so many parameters has one for each marker or pair.


def catalogue() -> str:
    """Return a heading for each family, and for each effect a heading, its physics, source and parameters."""
    return "\n".join(_format_families())


def _format_families() -> Iterator[str]:
    built_in = [effect for family in FAMILIES for effect in family.EFFECTS]
    order = [*_TITLES]
    ordered = sorted(built_in, key=lambda effect: order.index(effect.family))
    for family, effects in groupby(ordered, key=lambda effect: effect.family):
        yield f"### {_TITLES[family]}\n"
        for effect in effects:
            yield from _format_entry(effect)


def _format_entry(effect: Effect) -> Iterator[str]:
    ways = _join_words(f"`{way}`" for way in effect.enters())
    trials = _join_words(words for kind, words in _TRIALS.items() if kind in effect.seen_in)
    source = effect.source.rstrip(".")
    yield f"#### {effect.name}\n"
    yield f"{effect.physics.rstrip('.')}.\n"
    yield f"Stage *{effect.stage}*, by {ways}; seen in {trials}. Source: {source}.\n"
    shown = effect.parameters if len(effect.parameters) < _MANY else effect.parameters[:2]
    yield "| parameter | unit | bounds | prior sd |\n|---|---|---|---|"
    yield from map(_format_row, shown)
    if len(shown) < len(effect.parameters):
        yield "| … | | | |"
    yield ""


def _format_row(parameter: Parameter) -> str:
    return f"| {parameter.name} | {parameter.unit} | {parameter.low:g} to {parameter.high:g} | {parameter.sd:g} |"


def _join_words(words: Iterable[str]) -> str:
    *first, last = words
    return f"{', '.join(first)} and {last}" if first else last
