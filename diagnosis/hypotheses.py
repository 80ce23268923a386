"""Probabilities by Bayes' rule: of no gap, of sets of effects, and of an unknown effect.

`average_hypotheses` weighs every hypothesis by its evidence (`diagnosis.evidence`) and prior. The probabilities are
averaged over the size of the fitted twin's own discrepancy in this session.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp

from diagnosis.constants import (
    AT_PLACES,
    GROWN,
    LAUNCHES,
    MOST_EFFECTS,
    PAIRED,
    SCALES,
    UNLIKELY,
    USUAL_ERROR,
)
from diagnosis.effect_response import EffectResponse, effect_responses
from diagnosis.evidence import Hypotheses, Priors, Residual
from diagnosis.linear_model import LinearModel
from diagnosis.places import LocalDiscrepancy
from fitting.signatures import Signature

USUAL = Priors()


class Hypothesis(NamedTuple):
    """One hypothesis about what is present.

    Attributes:
        present: effects by their places in the catalogue, each itself or an unknown one that looks like it.
        other: whether there is an unknown effect besides.
    """

    present: tuple[int, ...]
    other: bool = False


@dataclass(frozen=True, eq=False)
class Probabilities:
    """Posterior probabilities of a session.

    Attributes:
        names: (e,) names of the effects.
        of: probability of each hypothesis that was tried; they add up to 1.
        at_place: (n,) probability of an unknown effect at each place, with whatever effects.
        look_alike: (2, e) odds that what looks like an effect is an unknown one: without another unknown one, and with.
    """

    names: tuple[str, ...]
    of: dict[Hypothesis, float]
    at_place: tuple[float, ...] = ()
    look_alike: np.ndarray | None = None

    def refuted(self, name: str) -> "Probabilities":
        """Return the probabilities given that an effect is absent.

        Each set that holds it passes its probability on to the set without it: with nothing in its place, or an unknown
        effect, as likely against each other as they were.
        """
        gone = self.names.index(name)
        found: dict[Hypothesis, float] = {}
        for each, chance in self.of.items():
            shares = {each: 1.0}
            if gone in each.present:
                rest = tuple(i for i in each.present if i != gone)
                nothing, unknown = (self.of.get(Hypothesis(rest, other), 0.0) for other in (each.other, True))
                share = nothing / (nothing + unknown) if nothing else 0.0
                shares = {Hypothesis(rest, True): 1 - share}
                shares[Hypothesis(rest, each.other)] = shares.get(Hypothesis(rest, each.other), 0.0) + share
            for key, share in shares.items():
                found[key] = found.get(key, 0.0) + share * chance
        return Probabilities(self.names, found, self.at_place, self.look_alike)

    def doubted(self) -> "Probabilities":
        """Return the probabilities where no set of effects suffices: something else is as likely as every name."""
        found: dict[Hypothesis, float] = {}
        for each, chance in self.of.items():
            share = 0.5 if each.present else 1.0
            found[each] = found.get(each, 0.0) + share * chance
            other = Hypothesis((), True)
            found[other] = found.get(other, 0.0) + (1 - share) * chance
        return Probabilities(self.names, found, self.at_place, self.look_alike)

    def either_or(self, one: str, other: str) -> tuple[float, float, float]:
        """Return the probabilities that only the one of two effects is seen, only the other, and both."""
        first, second = self.names.index(one), self.names.index(other)
        there = [(first in each.present, second in each.present, chance) for each, chance in self.of.items()]
        alone = sum(p for a, b, p in there if a and not b), sum(p for a, b, p in there if b and not a)
        return *alone, sum(p for a, b, p in there if a and b)

    @property
    def null(self) -> float:
        """Probability that there is no gap."""
        return self.of.get(Hypothesis(()), 0.0)

    @property
    def other(self) -> float:
        """Probability that there is an unknown effect, and none of the catalogue."""
        return sum(p * self._none_of(each, each.present) for each, p in self.of.items() if each.present or each.other)

    @property
    def with_other(self) -> float:
        """Probability that there is an unknown effect, with whatever effects."""
        return sum(p if each.other else p * (1 - self._all_of(each)) for each, p in self.of.items())

    def any_present(self, effects: Collection[int]) -> float:
        """Return the probability that at least one of some effects is present."""
        return sum(p * (1 - self._none_of(each, set(each.present) & set(effects))) for each, p in self.of.items())

    def any_seen(self, effects: Collection[int]) -> float:
        """Return the probability that at least one of some effects is present, or an unknown one that looks like it."""
        return sum(p for each, p in self.of.items() if set(each.present) & set(effects))

    @cached_property
    def marginal(self) -> np.ndarray:
        """Probability (e,) that each effect is present."""
        return np.minimum([self.any_present([i]) for i in range(len(self.names))], 1.0)  # sums of exponentials round

    def _unknown(self, each: Hypothesis, effect: int) -> float:
        """Return the probability that what looks like an effect is an unknown one."""
        odds = 0.0 if self.look_alike is None else float(self.look_alike[int(each.other), effect])
        return odds / (1 + odds)

    def _none_of(self, each: Hypothesis, effects: Collection[int]) -> float:
        return float(np.prod([self._unknown(each, i) for i in effects]))

    def _all_of(self, each: Hypothesis) -> float:
        return float(np.prod([1 - self._unknown(each, i) for i in each.present]))


class HypothesisWeights(NamedTuple):
    """Log of evidence times prior of hypotheses, and of an unknown effect at each of n places."""

    logs: dict[Hypothesis, float]
    places: np.ndarray

    @classmethod
    def of(cls, hypotheses: Hypotheses, most: int = MOST_EFFECTS, *, unknown: bool = True) -> "HypothesisWeights":
        """Weigh all single effects, pairs of the likeliest, and larger sets where they are likelier still.

        Args:
            hypotheses: what is weighed.
            most: largest number of effects in a set.
            unknown: whether an unknown effect may act, too.
        """
        logs: dict[Hypothesis, float] = {}
        shows = [i for i, each in enumerate(hypotheses.effects) if each.linear]
        for present in [(), *((i,) for i in shows)]:
            _weigh(hypotheses, logs, present)
        most = min(most, len(hypotheses.priors.number) - 1)
        for pair in _pairs(logs, shows) if most > 1 else ():
            _weigh(hypotheses, logs, pair)
        for size in range(3, most + 1):
            for present in _larger(logs, shows, size):
                _weigh(hypotheses, logs, present)
        if not unknown:
            nowhere = np.full(len(hypotheses.places), -np.inf)
            return cls({key: log for key, log in logs.items() if not key.other}, nowhere)
        return cls(logs, _weigh_places(hypotheses, logs))


def posterior(parts: Sequence[tuple[float, HypothesisWeights]], hypotheses: Hypotheses) -> Probabilities:
    """Combine the weights under several assumptions into probabilities.

    Args:
        parts: log probability of each assumption, and weights under it.
        hypotheses: the hypotheses under the likeliest.
    """
    logs: dict[Hypothesis, float] = {}
    for assumed, part in parts:
        for key, log in part.logs.items():
            logs[key] = float(np.logaddexp(logs.get(key, -np.inf), assumed + log))
    every = range(len(hypotheses.effects))
    odds = np.array([[hypotheses.look_alike_odds(i, other) for i in every] for other in (False, True)])
    logs = {key: log + float(np.log1p(odds[int(key.other), list(key.present)]).sum()) for key, log in logs.items()}
    total = logsumexp(list(logs.values()))
    places = logsumexp([assumed + part.places for assumed, part in parts], axis=0) if len(parts[0][1].places) else []
    return Probabilities(
        names=tuple(each.name for each in hypotheses.effects),
        of={key: float(np.exp(log - total)) for key, log in logs.items()},
        at_place=tuple(np.exp(np.subtract(places, total)).tolist()),
        look_alike=odds,
    )


def _weigh(hypotheses: Hypotheses, logs: dict[Hypothesis, float], present: tuple[int, ...]) -> None:
    """Weigh a set of effects, with and without an unknown one."""
    for other in (False, True):
        prior = hypotheses.priors.log_prior(len(present), other, len(hypotheses.effects))
        logs[Hypothesis(present, other)] = hypotheses.evidence(present, other) + prior


def _weigh_places(hypotheses: Hypotheses, logs: dict[Hypothesis, float]) -> np.ndarray:
    """Add an unknown effect at one place to the likeliest sets, and return its log weight at each place (n,)."""
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
        found = prior + hypotheses.at_places(present)
        key = Hypothesis(present, True)
        logs[key] = float(logsumexp([logs[key], *found]))
        places = np.logaddexp(places, found)
    return places


def _larger(logs: dict[Hypothesis, float], shows: list[int], size: int) -> list[tuple[int, ...]]:
    """Return the likeliest sets of one effect less, with one more; none where a smaller set is likelier than these."""
    sets = sorted((key for key in logs if len(key.present) == size - 1), key=lambda key: -logs[key])[:GROWN]
    if not sets or logs[sets[0]] < max(logs.values()):
        return []
    return sorted({tuple(sorted((*present, i))) for present, _ in sets for i in shows if i not in present})


def _pairs(logs: dict[Hypothesis, float], shows: list[int]) -> set[tuple[int, int]]:
    """Return all pairs of the likeliest effects, and pairs of the two likeliest with all others."""
    alone = {i: max(logs[Hypothesis((i,))], logs[Hypothesis((i,), True)]) for i in shows}
    order = sorted(shows, key=lambda i: -alone[i])
    found = {(min(pair), max(pair)) for pair in combinations(order[:PAIRED], 2)}
    return found | {(min(first, i), max(first, i)) for first in order[:2] for i in order[PAIRED:]}


class AveragedHypotheses(NamedTuple):
    """Hypotheses with their probabilities, averaged over assumptions such as the size of the twin's own discrepancy.

    Attributes:
        linear, hypotheses: the linearised model and the hypotheses under the likeliest assumption.
        probabilities: the averaged probabilities.
        usual: the same over assumptions beside which an unknown effect may act; None where the likeliest is one.
    """

    linear: LinearModel
    hypotheses: Hypotheses
    probabilities: Probabilities
    usual: "AveragedHypotheses | None" = None


class Assumed(NamedTuple):
    """A linearised model under one assumption on what is not known.

    Attributes:
        log_prior: log prior probability of the assumption.
        linear: the model.
        unknown: whether an unknown effect may act besides; beside a small error of the twin it would be that error.
    """

    log_prior: float
    linear: LinearModel
    unknown: bool = True


def error_sizes(linear: LinearModel, signatures: Sequence[Signature], priors: Priors = USUAL) -> tuple[Assumed, ...]:
    """Return the model for every size of the twin's own discrepancy, and for each likely size of launch scatter.

    A scatter is likely where no effect or a single one leaves it so, beside a discrepancy of the usual size.
    """
    common = linear.discrepancy.common_columns(signatures)
    launches = {}
    for launch, chance in LAUNCHES.items():
        here = linear.with_error(1.0, common, launch)
        singles = HypothesisWeights.of(_hypotheses(here, signatures, priors, ()), most=1)
        launches[launch] = np.log(chance) + here.space.log_volume + logsumexp(list(singles.logs.values()))
    least = max(launches.values()) + np.log(UNLIKELY)
    return tuple(
        Assumed(
            float(np.log(chance * LAUNCHES[launch])),
            linear.with_error(size, common, launch),
            unknown=size >= USUAL_ERROR,
        )
        for launch, weight in launches.items()
        if weight > least
        for size, chance in SCALES.items()
    )


def average_hypotheses(
    assumptions: Sequence[Assumed],
    signatures: Sequence[Signature],
    priors: Priors,
    places: Sequence[LocalDiscrepancy] = (),
) -> AveragedHypotheses:
    """Weigh all hypotheses under every assumption.

    Args:
        assumptions: the linearised model under each.
        signatures: what each effect does.
        priors: prior probabilities.
        places: unknown effects at one place.
    """
    found = [_WeighedAssumption.of(each, signatures, priors, places) for each in assumptions]
    averaged, usual = _average(found), [each for each in found if each.assumed.unknown]
    if not usual or max(found, key=_WeighedAssumption.total).assumed.unknown:
        return averaged
    return averaged._replace(usual=_average(usual))


class _WeighedAssumption(NamedTuple):
    """An assumption, and the hypotheses under it with their weights."""

    assumed: Assumed
    hypotheses: Hypotheses
    weights: HypothesisWeights

    @classmethod
    def of(
        cls,
        assumed: Assumed,
        signatures: Sequence[Signature],
        priors: Priors,
        places: Sequence[LocalDiscrepancy],
    ) -> "_WeighedAssumption":
        """Weigh all hypotheses under an assumption."""
        hypotheses = _hypotheses(assumed.linear, signatures, priors, places)
        return cls(assumed, hypotheses, HypothesisWeights.of(hypotheses, unknown=assumed.unknown))

    @property
    def log_weight(self) -> float:
        """Log of its prior probability and of the volume of its noise: what all of its hypotheses share."""
        return self.assumed.log_prior + self.assumed.linear.space.log_volume

    def total(self) -> float:
        """Return the log weight of the assumption with all its hypotheses."""
        return self.log_weight + float(logsumexp(list(self.weights.logs.values())))


def _average(found: Sequence[_WeighedAssumption]) -> AveragedHypotheses:
    """Average over assumptions; model and hypotheses are those under the likeliest."""
    likeliest = max(found, key=_WeighedAssumption.total)
    linear, hypotheses = likeliest.assumed.linear, likeliest.hypotheses
    probabilities = posterior([(each.log_weight, each.weights) for each in found], hypotheses)
    return AveragedHypotheses(linear, hypotheses, probabilities)


def _hypotheses(
    linear: LinearModel,
    signatures: Sequence[Signature],
    priors: Priors,
    places: Sequence[LocalDiscrepancy],
) -> Hypotheses:
    parts = linear.parts if priors.by_part else None
    effects, features = effect_responses(signatures, linear.space, priors.strongest, parts), len(linear.model.measured)
    return Hypotheses(
        like_any=_against(linear, effects),
        loose=Residual.of(linear.space, linear.residual, linear.generic_root),
        effects=effects,
        priors=priors,
        not_features=slice(features, features + linear.model.beside),
        creeps=linear.model.places_of_creeps,
        places=tuple((each.weight, linear.space.projected(each.columns.T).T) for each in places),
    )


def _against(linear: LinearModel, effects: Sequence[EffectResponse]) -> Residual:
    """Return the residual against an unknown effect like these."""
    features = len(linear.model.measured)
    frequencies = slice(features, features + linear.model.frequencies)
    return Residual.of(linear.space, linear.residual, linear.generic_root, effects, frequencies)
