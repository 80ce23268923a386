"""The catalogue of effects as Markdown: `python docs/_site/catalogue.py` writes it into `docs/effects.md`."""

import textwrap
from collections.abc import Iterable, Iterator
from itertools import groupby
from pathlib import Path

from session.results import write_whole
from swimmer.effects import Effect, Parameter
from swimmer.effects.catalogue import FAMILIES

PAGE = Path(__file__).parents[1] / "effects.md"
BEGIN, END = "<!-- generated: catalogue -->\n", "<!-- end of the catalogue -->\n"
_TITLES = {
    "measurement": "Camera and tracker",
    "drive": "Clock and drive",
    "tendons": "Tendons",
    "structure": "Structure",
    "fluid": "Fluid and surroundings",
}
_TRIALS = {"swim": "swim trials", "dry": "dry runs", "free_decay": "free decays"}
_MANY = 8  # parameters: one for each marker or pair


def page_with_catalogue(page: str) -> str:
    """The page with the catalogue as it is between its marks."""
    head, _, rest = page.partition(BEGIN)
    return head + BEGIN + "\n" + "\n".join(_catalogue()) + "\n" + END + rest.partition(END)[2]


def _catalogue() -> Iterator[str]:
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
    yield _wrapped(f"{effect.physics.rstrip('.')}.") + "\n"
    yield _wrapped(f"Stage *{effect.stage}*, by {ways}; seen in {trials}. Source: {source}.") + "\n"
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


def _wrapped(text: str) -> str:
    return "\n".join(textwrap.wrap(text, 120, break_long_words=False, break_on_hyphens=False))


if __name__ == "__main__":
    write_whole(PAGE, page_with_catalogue(PAGE.read_text()))
