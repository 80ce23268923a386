"""Names that held-out swims speak against: what helps the fitted swims alone is no effect.

A twin with what is really there forecasts other swims better, or, where they show little of it, about as well. Where
the whole 95 % interval of the shrinkage lies below zero it forecasts them worse, and the names are taken back: what the
fitted swims show only looks like these effects. By the interval that happens to one right name of forty at most. It is
the one use of held-out swims for what is said; a shrinkage beside names that stayed is the more favourable for it, by
as much as that seldom happens.
"""

from typing import NamedTuple

from diagnosis.evidence import Explanations
from diagnosis.held_out import Gap
from diagnosis.refit import Refit

_IN_GAITS = 0.5  # share of what an effect does, below which held-out gaits say nothing of it


class Refutation(NamedTuple):
    """Of the names of a verdict, all together.

    Attributes:
        effects: the likeliest of each group, with which the twin was refitted.
        shrinkage: of the held-out gap with them.
        interval: 95 %.
    """

    effects: tuple[str, ...]
    shrinkage: float
    interval: tuple[float, float]


def refutation_of(gap: Gap | None, best: Refit | None, explanations: Explanations) -> Refutation | None:
    """Of the effects of a refitted twin; None where held-out swims do not speak against them.

    Nor do they against effects that change frequencies: a shrinkage leaves these out.
    """
    if gap is None or best is None or gap.shrinkage.value is None or gap.shrinkage.interval is None:
        return None
    names = [each.name for each in explanations.effects]
    if all(explanations.of_gaits(names.index(effect.name)) < _IN_GAITS for effect in best.effects):
        return None
    if gap.shrinkage.interval[1] >= 0:
        return None
    return Refutation(tuple(effect.name for effect in best.effects), gap.shrinkage.value, gap.shrinkage.interval)
