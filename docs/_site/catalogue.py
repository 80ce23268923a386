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
_MANY = 8  # parameters: one for each marker or pair


def catalogue() -> str:
    """Return a heading for each family, and for each effect a heading, its physics, source and parameters."""
    return "\n".join(_families())


def _families() -> Iterator[str]:
    built_in = [effect for family in FAMILIES for effect in family.EFFECTS]
    order = [*_TITLES]
    ordered = sorted(built_in, key=lambda effect: order.index(effect.family))
    for family, effects in groupby(ordered, key=lambda effect: effect.family):
        yield f"### {_TITLES[family]}\n"
        for effect in effects:
            yield from _entry(effect)


def _entry(effect: Effect) -> Iterator[str]:
    ways = _listed(f"`{way}`" for way in effect.enters())
    trials = _listed(words for kind, words in _TRIALS.items() if kind in effect.seen_in)
    source = effect.source.rstrip(".")
    yield f"#### {effect.name}\n"
    yield f"{effect.physics.rstrip('.')}.\n"
    yield f"Stage *{effect.stage}*, by {ways}; seen in {trials}. Source: {source}.\n"
    shown = effect.parameters if len(effect.parameters) < _MANY else effect.parameters[:2]
    yield "| parameter | unit | bounds | prior sd |\n|---|---|---|---|"
    yield from map(_row, shown)
    if len(shown) < len(effect.parameters):
        yield "| … | | | |"
    yield ""


def _row(parameter: Parameter) -> str:
    return f"| {parameter.name} | {parameter.unit} | {parameter.low:g} to {parameter.high:g} | {parameter.sd:g} |"


def _listed(words: Iterable[str]) -> str:
    *first, last = words
    return f"{', '.join(first)} and {last}" if first else last
