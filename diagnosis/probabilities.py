"""From evidences to probabilities: of nothing, of sets of effects, and of something else beside them."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.special import expit, logsumexp

from diagnosis.constants import AT_PLACES, GROWN, MOST_EFFECTS, PAIRED
from diagnosis.evidence import Hypotheses
from diagnosis.many import standing


class Hypothesis(NamedTuple):
    """One of all that there may be.

    Attributes:
        present: effects by their places.
        other: whether there is something else beside them.
        like: an effect that this something else looks like, and which is not there; None where it looks like none.
    """

    present: tuple[int, ...]
    other: bool = False
    like: int | None = None

    @property
    def seen(self) -> frozenset[int]:
        """Effects that it looks like, present or not."""
        return frozenset(self.present if self.like is None else (*self.present, self.like))


@dataclass(frozen=True, eq=False)
class Probabilities:
    """After a session was looked at.

    Attributes:
        names: (e,) of the effects.
        of: probability of each explanation that was tried; they add up to 1.
        at_place: (n,) that there is something else, at each place, beside whatever effects.
    """

    names: tuple[str, ...]
    of: dict[Hypothesis, float]
    at_place: tuple[float, ...] = ()

    @classmethod
    def after(cls, hypotheses: Hypotheses) -> "Probabilities":
        """By Bayes' rule: all single effects, pairs of the likeliest, and larger sets where they are likelier still."""
        logs: dict[Hypothesis, float] = {}
        shows = [i for i, each in enumerate(hypotheses.effects) if each.forms]
        for present in [(), *((i,) for i in shows)]:
            _try(hypotheses, logs, present)
        for pair in _pairs(logs, shows):
            _try(hypotheses, logs, pair)
        for size in range(3, MOST_EFFECTS + 1):
            for present in _larger(logs, shows, size):
                _try(hypotheses, logs, present)
        places = _somewhere(hypotheses, logs)
        logs |= _imitations(hypotheses, logs)
        logs = _among_many(hypotheses, logs)
        total = logsumexp(list(logs.values()))
        chances = {key: float(np.exp(value - total)) for key, value in logs.items()}
        return cls(tuple(each.name for each in hypotheses.effects), chances, tuple(np.exp(places - total).tolist()))

    @classmethod
    def averaged(cls, parts: Sequence[tuple[float, "Probabilities"]]) -> "Probabilities":
        """Under several assumptions, with the probability of each; these add up to 1."""
        found: dict[Hypothesis, float] = {}
        for chance, part in parts:
            for key, of in part.of.items():
                found[key] = found.get(key, 0.0) + chance * of
        places = np.sum([chance * np.array(part.at_place) for chance, part in parts], axis=0)
        return cls(parts[0][1].names, found, tuple(places.tolist()))

    def with_odds(self, group: Collection[str], log_odds: float, beside: Collection[str]) -> "Probabilities":
        """With these odds of a group beside others, if it was taken for likelier; one that was not stays as it is.

        Its sets in which others are seen pass the rest on to those without it: what there would be without any of the
        others was not asked.

        Args:
            group: alternatives of which one is seen.
            log_odds: that it is, if one of the others is.
            beside: the others, which act with it.
        """
        own, others = ({self.names.index(name) for name in part} for part in (group, beside))
        asked = {each for each in self.of if each.seen & own and each.seen & others}
        both = sum(self.of[each] for each in asked)
        kept = min(float(expit(log_odds)) * self.any_seen(others) / max(both, 1e-300), 1.0)
        found: dict[Hypothesis, float] = {}
        for each, chance in self.of.items():
            like = None if each.like in own else each.like
            without = Hypothesis(tuple(i for i in each.present if i not in own), each.other and like == each.like, like)
            share = kept if each in asked else 1.0
            for key, part in ((each, share), (without, 1 - share)):
                found[key] = found.get(key, 0.0) + part * chance
        return Probabilities(self.names, found, self.at_place)

    def refuted(self, name: str) -> "Probabilities":
        """With this effect not there after all; what else there is stays as likely as it was.

        Each set that holds it passes on to what there is without: nothing in its place, or something else that looks
        like it, as likely against each other as both were; where neither was tried, to the latter.
        """
        gone = self.names.index(name)
        found: dict[Hypothesis, float] = {}
        for each, chance in self.of.items():
            shares = {each: 1.0}
            if gone in each.present:
                rest = tuple(i for i in each.present if i != gone)
                without, alike = Hypothesis(rest, each.other), Hypothesis(rest, True, gone)
                nothing, something = (self.of.get(one, 0.0) for one in (without, alike))
                share = nothing / (nothing + something) if nothing else 0.0
                shares = {without: share, alike: 1.0 - share}
            for key, share in shares.items():
                found[key] = found.get(key, 0.0) + share * chance
        return Probabilities(self.names, found, self.at_place)

    def either_or(self, one: str, other: str) -> tuple[float, float, float]:
        """That the one of two effects is there and not the other, the other and not the one, and both."""
        first, second = self.names.index(one), self.names.index(other)
        there = [(first in each.present, second in each.present, chance) for each, chance in self.of.items()]
        alone = sum(p for a, b, p in there if a and not b), sum(p for a, b, p in there if b and not a)
        return *alone, sum(p for a, b, p in there if a and b)

    @property
    def null(self) -> float:
        """That there is nothing."""
        return self.of.get(Hypothesis(()), 0.0)

    @property
    def other(self) -> float:
        """That there is something else, and no effect of the catalogue."""
        return sum(chance for each, chance in self.of.items() if each.other and not each.present)

    @property
    def with_other(self) -> float:
        """That there is something else, beside whatever effects."""
        return sum(chance for each, chance in self.of.items() if each.other)

    def any_present(self, effects: Collection[int]) -> float:
        """That at least one of some effects is present."""
        return sum(chance for each, chance in self.of.items() if set(each.present) & set(effects))

    def any_seen(self, effects: Collection[int]) -> float:
        """That at least one of some effects is present, or something else that looks like it."""
        return sum(chance for each, chance in self.of.items() if each.seen & set(effects))

    @cached_property
    def marginal(self) -> np.ndarray:
        """(e,) that each effect is present."""
        total = np.zeros(len(self.names))
        for each, chance in self.of.items():
            total[list(each.present)] += chance
        return np.minimum(total, 1.0)  # sums of exponentials round


def _try(hypotheses: Hypotheses, logs: dict[Hypothesis, float], present: tuple[int, ...]) -> None:
    """Weighs a set of effects, with and without something else."""
    for other in (False, True):
        if (key := Hypothesis(present, other)) not in logs:
            prior = hypotheses.priors.log_prior(len(present), other, len(hypotheses.effects))
            logs[key] = hypotheses.evidence(present, other) + prior


def _somewhere(hypotheses: Hypotheses, logs: dict[Hypothesis, float]) -> np.ndarray:
    """Weighs what else may be at one place beside the likeliest sets; (n,) by place."""
    places = np.full(len(hypotheses.places), -np.inf)
    if not len(places):
        return places
    placed = hypotheses.priors.placed
    for key in logs:
        if key.other:
            logs[key] += float(np.log1p(-placed))
    every = {key.present: max(logs[key], logs[Hypothesis(key.present, True)]) for key in logs if not key.other}
    likeliest = sorted(every, key=lambda present: -every[present])[:AT_PLACES]
    for present in {(), *likeliest}:
        prior = hypotheses.priors.log_prior(len(present), True, len(hypotheses.effects)) + np.log(placed)
        found = prior + hypotheses.somewhere(present)
        key = Hypothesis(present, True)
        logs[key] = float(logsumexp([logs[key], *found]))
        places = np.logaddexp(places, found)
    return places


def _among_many(hypotheses: Hypotheses, logs: dict[Hypothesis, float]) -> dict[Hypothesis, float]:
    """With effects that surely are in the mixture that something else is, where it surely is one, told as present."""
    likeliest = max(logs, key=lambda key: logs[key])
    if not likeliest.other:
        return logs
    among = standing(hypotheses, likeliest.present)
    if not among:
        return logs
    chance = min(among.values())
    with np.errstate(divide="ignore"):  # of what is certain
        as_it_was, with_them = np.log1p(-chance), np.log(chance)
    found: dict[Hypothesis, float] = {}
    for key, log in logs.items():
        shares = {key: log}
        present = tuple(sorted({*key.present, *among}))
        if key.other and present != key.present:
            shares = {key: log + as_it_was, key._replace(present=present): log + with_them}
        for each, told in shares.items():
            found[each] = float(np.logaddexp(found.get(each, -np.inf), told))
    return found


def _imitations(hypotheses: Hypotheses, logs: dict[Hypothesis, float]) -> dict[Hypothesis, float]:
    """Each set with something in the place of one of its effects that only looks like it, and how likely that is.

    Where it strays too little to show it is as likely as the effect would be, else as that and something else beside;
    but something else strays in features: what changes frequencies alone, of each trial by as much, is no chance.
    """
    found, priors = {}, hypotheses.priors
    beside = np.log(priors.other) - np.log1p(-priors.other)
    with np.errstate(divide="ignore"):
        for present in [each.present for each in logs if each.present and not each.other]:
            for effect in present:
                unseen = hypotheses.unseen(effect)
                alone = logs[Hypothesis(present)] + np.log(unseen) + hypotheses.non_periodic
                shows = (1 - unseen) * hypotheses.of_features(effect)
                strays = logs[Hypothesis(present, True)] - beside + np.log(shows)
                rest = tuple(i for i in present if i != effect)
                odds = np.log(priors.imitated)
                found[Hypothesis(rest, True, effect)] = float(odds + np.logaddexp(alone, strays))
    return found


def _larger(logs: dict[Hypothesis, float], shows: list[int], size: int) -> list[tuple[int, ...]]:
    """The likeliest sets with one effect less, and one more; none where a smaller set is likelier than these."""
    sets = sorted((key for key in logs if len(key.present) == size - 1), key=lambda key: -logs[key])[:GROWN]
    if not sets or logs[sets[0]] < max(logs.values()):
        return []
    return sorted({tuple(sorted((*present, i))) for present, *_ in sets for i in shows if i not in present})


def _pairs(logs: dict[Hypothesis, float], shows: list[int]) -> set[tuple[int, int]]:
    """The likeliest with each other; and the two likeliest with all others."""
    alone = {i: max(logs[Hypothesis((i,))], logs[Hypothesis((i,), True)]) for i in shows}
    order = sorted(shows, key=lambda i: -alone[i])
    found = {(min(pair), max(pair)) for pair in combinations(order[:PAIRED], 2)}
    return found | {(min(first, i), max(first, i)) for first in order[:2] for i in order[PAIRED:]}
