"""Names that held-out swims speak against: what helps the fitted swims alone is no effect.

A twin with what is really there forecasts other swims better, or, where they show little of it, about as well. Where
the whole 95 % interval of the shrinkage lies below zero it forecasts them worse, and a name is taken back: what the
fitted swims show only looks like it. To right names that happens as often as the interval lies above the truth, one
time in forty if it is calibrated; and where a partner of theirs is missing, or their form is far from what is there.
So a shrinkage beside names that stayed is selected, and the more favourable for it.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from diagnosis.evidence import Explanations
from diagnosis.gap import Shrinkage
from diagnosis.held_out import Gap
from diagnosis.probabilities import Probabilities
from diagnosis.refit import Refit
from diagnosis.verdict import Verdict

_IN_GAITS = 0.5  # share of what an effect does, below which held-out gaits say nothing of it


class Refutation(NamedTuple):
    """Of the likeliest of a group of a verdict; of its alternatives nothing was asked, and they stay as likely.

    Attributes:
        effect: with which the twin was refitted.
        shrinkage: of the held-out gap with it and what was named beside it.
        interval: 95 %.
    """

    effect: str
    shrinkage: float
    interval: tuple[float, float]


class Stood(NamedTuple):
    """What held-out swims leave of a verdict.

    Attributes:
        verdict, probabilities: without what was taken back.
        best: the twin with the rest of the effects; None where none is left.
        gap: on the held-out swims, with that twin.
        refutations: of what was taken back, in that order.
    """

    verdict: Verdict
    probabilities: Probabilities
    best: Refit | None
    gap: Gap | None
    refutations: tuple[Refutation, ...]


def stood(
    found: Stood,
    explanations: Explanations,
    refitting: Callable[[Sequence[str]], Refit],
    forecast: Callable[[Refit | None], Gap | None],
) -> Stood:
    """Takes names back, the least likely first, for as long as held-out swims speak against them.

    Args:
        found: before.
        explanations: of the fitted swims.
        refitting: the twin with effects of these names.
        forecast: the held-out gap with a twin.
    """
    verdict, probabilities, best, gap, refutations = found
    while best is not None and gap is not None and (against := refutable(gap.shrinkage, best, explanations)):
        weakest = min(against, key=lambda name: probabilities.marginal[probabilities.names.index(name)])
        assert gap.shrinkage.value is not None
        assert gap.shrinkage.interval is not None
        refutations = (*refutations, Refutation(weakest, gap.shrinkage.value, gap.shrinkage.interval))
        probabilities = probabilities.refuted(weakest)
        verdict = verdict.without([weakest], probabilities)
        best = refitting(verdict.first) if verdict.first else None
        gap = forecast(best)
    return Stood(verdict, probabilities, best, gap, refutations)


def refutable(told: Shrinkage, best: Refit, explanations: Explanations) -> tuple[str, ...]:
    """Effects of a refitted twin one of which held-out swims speak against; none where they do not.

    Never those that change frequencies: a shrinkage leaves these out.
    """
    if told.interval is None or told.interval[1] >= 0:
        return ()
    names = [each.name for each in explanations.effects]
    asked = (effect.name for effect in best.effects)
    return tuple(name for name in asked if explanations.of_gaits(names.index(name)) >= _IN_GAITS)
