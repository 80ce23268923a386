"""From evidences to probabilities: of nothing, of sets of effects, and of something else beside them."""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from scipy.special import expit, logsumexp

from diagnosis.evidence import Explanations

_TRIED = 8  # of the likeliest effects, of which pairs are tried
_MOST = 4  # effects at once
_KEPT = 3  # sets of effects that are tried with one more
Key = tuple[tuple[int, ...], bool]
"""A set of effects by their places, and whether there is something else."""


@dataclass(frozen=True, eq=False)
class Probabilities:
    """After a session was looked at.

    Attributes:
        names: (e,) of the effects.
        of: probability of each explanation that was tried; they add up to 1.
    """

    names: tuple[str, ...]
    of: dict[Key, float]

    @classmethod
    def after(cls, explanations: Explanations) -> "Probabilities":
        """By Bayes' rule: all single effects, pairs of the likeliest, and larger sets where they are likelier still."""
        logs: dict[Key, float] = {}
        shows = [i for i, each in enumerate(explanations.effects) if each.forms]
        for present in [(), *((i,) for i in shows)]:
            _try(explanations, logs, present)
        for pair in _pairs(logs, shows):
            _try(explanations, logs, pair)
        for size in range(3, _MOST + 1):
            for present in _larger(logs, shows, size):
                _try(explanations, logs, present)
        total = logsumexp(list(logs.values()))
        chances = {key: float(np.exp(value - total)) for key, value in logs.items()}
        return cls(tuple(each.name for each in explanations.effects), chances)

    def with_odds(self, name: str, log_odds: float) -> "Probabilities":
        """With these odds of an effect that was taken for likelier; its sets pass the rest on to those without it."""
        effect = self.names.index(name)
        kept = min(float(expit(log_odds)) / max(float(self.marginal[effect]), 1e-300), 1.0)
        found: dict[Key, float] = {}
        for (present, other), chance in self.of.items():
            without = tuple(i for i in present if i != effect)
            share = kept if effect in present else 1.0
            for key, own in (((present, other), share), ((without, other), 1 - share)):
                found[key] = found.get(key, 0.0) + own * chance
        return Probabilities(self.names, found)

    @property
    def null(self) -> float:
        """That there is nothing."""
        return self.of[(), False]

    @property
    def other(self) -> float:
        """That there is something else, and no effect of the catalogue."""
        return self.of[(), True]

    @cached_property
    def marginal(self) -> np.ndarray:
        """(e,) that each effect is present."""
        total = np.zeros(len(self.names))
        for (present, _), chance in self.of.items():
            total[list(present)] += chance
        return np.minimum(total, 1.0)  # sums of exponentials round


def _try(explanations: Explanations, logs: dict[Key, float], present: tuple[int, ...]) -> None:
    """Weighs a set of effects, with and without something else."""
    for other in (False, True):
        if (present, other) not in logs:
            prior = explanations.belief.log_prior(len(present), other, len(explanations.effects))
            logs[present, other] = explanations.evidence(present, other) + prior


def _larger(logs: dict[Key, float], shows: list[int], size: int) -> list[tuple[int, ...]]:
    """The likeliest sets with one effect less, and one more; none where a smaller set is likelier than these."""
    sets = sorted((key for key in logs if len(key[0]) == size - 1), key=lambda key: -logs[key])[:_KEPT]
    if not sets or logs[sets[0]] < max(logs.values()):
        return []
    return sorted({tuple(sorted((*present, i))) for present, _ in sets for i in shows if i not in present})


def _pairs(logs: dict[Key, float], shows: list[int]) -> set[tuple[int, int]]:
    """The likeliest with each other; and the two likeliest with all others."""
    alone = {i: max(logs[(i,), False], logs[(i,), True]) for i in shows}
    order = sorted(shows, key=lambda i: -alone[i])
    found = {(min(pair), max(pair)) for pair in combinations(order[:_TRIED], 2)}
    return found | {(min(first, i), max(first, i)) for first in order[:2] for i in order[_TRIED:]}
