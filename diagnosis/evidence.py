"""Evidence for effects: the marginal likelihood of the residual under each hypothesis, in one Gaussian linear model.

An effect enters by its `EffectResponse`, linear over each range of its strengths, made from its signature
(`effect_responses`). In the whitened residual space the residual is then normal with covariance

    I + sum_k s_k^2 D_k D_k' + (e^2 |D|^2 + s^2) G

D_k: columns of effect k, whose strengths are normal about zero; s_k: its size. |D|: the norm of all effects of the
hypothesis, of which a share e, the form error, is in no response. s: the size of an unknown effect, with covariance G
of mean variance 1: a random mixture of all effects, or one that only neighbouring markers share. Sizes and form errors
are averaged over a grid (`gaussian_evidence`), sizes log-uniform from just detectable to what bounds allow; strengths
stay within the range of their linear response (Rasmussen and Williams 2006, chapter 5). An unknown effect may instead
act at one place, by columns of its own (`Hypotheses.at_places`).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from math import comb
from typing import NamedTuple

import numpy as np
from scipy.special import log_ndtr

from diagnosis.constants import IN_CREEPS, IN_FEATURES, LOOSE, MOST_WRONG, SHOWS, SIZES
from diagnosis.effect_response import EffectResponse, LinearResponse
from fitting.signatures import Whitened

_USUAL_SD = 3.0  # strengths at which form errors are taken, in standard deviations: not held back, but finite
_TINY = 1e-12  # keeps logarithms and quotients finite
_NO_VARIANCE = 1e-13  # share of the largest variance of an unknown effect up to which one is rounding


@dataclass(frozen=True)
class Priors:
    """Prior probabilities, chosen on sessions of development.

    Attributes:
        form_error: shares of the norm of an effect that its response may miss, equally likely.
        number: prior probabilities of none, one, two … effects.
        other: prior probability of an unknown effect, with whatever effects.
        placed: probability that an unknown effect acts at one place.
        look_alike: odds, against an effect, of an unknown one that looks like it.
        look_alike_beside: the same of one with another unknown effect besides.
        differs: least share of its norm by which such a one differs; at most all of it, log-uniform.
        most_wrong: largest whitened norm of a form error: a larger residual is due to something else.
        strongest: largest strength of an effect, in standard deviations of its parameters.
        by_part: whether a form error also changes the size of each part of a response by itself.
    """

    form_error: tuple[float, ...] = (0.05, 0.2, 0.5)
    number: tuple[float, ...] = (0.5, 0.38, 0.1, 0.015, 0.003, 0.0015, 0.0005)
    other: float = 0.1
    placed: float = 0.4
    look_alike: float = 0.3
    look_alike_beside: float = 0.3
    differs: float = 0.05
    most_wrong: float = MOST_WRONG
    strongest: float = np.inf
    by_part: bool = False

    def log_prior(self, present: int, other: bool, effects: int) -> float:
        """Return the log prior probability of one set of effects.

        Args:
            present: number of effects in the set.
            other: whether there is an unknown effect besides.
            effects: number of effects in the catalogue.
        """
        chance = self.number[present] / comb(effects, present)
        return float(np.log(chance) + np.log(self.other if other else 1 - self.other))


@dataclass(frozen=True, eq=False)
class Residual:
    """The whitened residual in the eigenvectors of the covariance of an unknown effect.

    Attributes:
        turn: (q, k) projection from the whitened residual space.
        value: (q,) the residual.
        spread: (q,) variances of the unknown effect, of mean 1.
    """

    turn: np.ndarray
    value: np.ndarray
    spread: np.ndarray
    _turned: dict[LinearResponse, np.ndarray] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        space: Whitened,
        residual: np.ndarray,
        generic_root: np.ndarray,
        effects: Sequence[EffectResponse] = (),
        frequencies: slice = slice(0, 0),
    ) -> "Residual":
        """Project the residual onto an unknown effect like those given, but for a share `LOOSE` of its variance.

        The unknown effect leaves frequencies alone: only clock and drive change these.

        Args:
            space: the whitened residual space.
            residual: (k,) the residual.
            generic_root: (k, k) columns that make up the covariance of an unknown effect without structure; all of
                it where no effects are given.
            effects: the effects that the unknown one resembles.
            frequencies: places of the frequencies in the residual.
        """
        others = np.ones((len(generic_root) + len(space.precision), 1))
        others[frequencies] = 0.0
        loose = space.projected(generic_root.T).T  # (k, q)
        like = [others * each.slopes / np.linalg.norm(each.slopes) for each in effects if each.ways]
        share = LOOSE if like else 1.0
        parts = [np.sqrt(share) * loose / np.linalg.norm(loose)]
        parts += [np.sqrt((1 - share) / len(like)) * part for part in like]
        columns = np.hstack(parts)
        spread, turn = np.linalg.eigh(columns @ columns.T)
        inside = spread > _NO_VARIANCE * spread[-1]
        spread, turn = spread[inside], turn[:, inside].T
        return cls(turn, turn @ space.projected(residual), spread / spread.mean())

    def columns_of(self, response: LinearResponse) -> np.ndarray:
        """Return the columns (q, p) of a response, of one standard deviation each; they are turned once."""
        if response not in self._turned:
            self._turned[response] = self.turn @ response.columns
        return self._turned[response]


class GaussianEvidence(NamedTuple):
    """Gaussian evidence of a residual, without the factor (2 pi)^(q/2), and its variances at the likeliest sizes.

    Attributes:
        evidence: log evidence, averaged over a grid of sizes.
        columns: (q, p) columns of the effects, with the likeliest sizes.
        variance: (q,) variances of the rest with these.
    """

    evidence: float
    columns: np.ndarray
    variance: np.ndarray


def gaussian_evidence(
    residual: Residual, responses: Sequence[LinearResponse], other: bool, priors: Priors
) -> GaussianEvidence:
    """Return the evidence of a residual with effects of these responses.

    Args:
        residual: the residual.
        responses: responses of the effects.
        other: whether there is an unknown effect besides.
        priors: which shares of their norm the responses may miss.
    """
    if priors.by_part and responses:
        return _evidence_by_part(residual, responses, other, priors)
    axes = [*map(_sizes, responses), SIZES if other else [0.0], priors.form_error if responses else [0.0]]
    grid = np.array(list(product(*axes)))  # (s, r + 2)
    parts = [residual.columns_of(each) / each.size for each in responses]
    columns = np.hstack([np.zeros((len(residual.value), 0)), *parts])  # (q, p)
    whose = np.repeat(np.arange(len(parts)), [part.shape[1] for part in parts])
    sizes = grid[:, whose]  # (s, p)
    wrong = grid[:, -1] * np.minimum(_norms(residual, responses, columns, whose, sizes), priors.most_wrong)
    variance = 1 + np.outer((wrong**2 + grid[:, -2] ** 2) / len(residual.value), residual.spread)  # (s, q)
    weight, count = 1 / variance, columns.shape[1]
    pairs = (columns[:, :, None] * columns[:, None]).reshape(len(columns), -1)  # (q, p p)
    gram = (weight @ pairs).reshape(len(grid), count, count)  # (s, p, p)
    precision = np.eye(count) + sizes[:, :, None] * gram * sizes[:, None]
    along, covariance = sizes * (weight @ (columns * residual.value[:, None])), np.linalg.inv(precision)
    mean = (covariance @ along[:, :, None])[:, :, 0]
    squares = weight @ residual.value**2 + np.log(variance).sum(axis=1) - (along * mean).sum(axis=1)
    logs = -0.5 * (squares + np.linalg.slogdet(precision)[1])
    if len(whose):
        ends = [np.vstack([each.low, each.high, each.bounds]) * each.size for each in responses]
        low, high, least, most = np.hstack(ends)[:, None] / sizes
        sd = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
        logs += (log_mass((low - mean) / sd, (high - mean) / sd) - log_mass(least, most)).sum(axis=1)
    best = int(np.argmax(logs))
    return GaussianEvidence(_mean(logs), columns * sizes[best], variance[best])


class CovarianceOfRest(NamedTuple):
    """Covariance diag(variance) + form form' of what an effect leaves: noise, form error, and an unknown effect.

    Attributes:
        variance: (q,) of noise, of an unknown effect, and of the form error without structure.
        form: (q, g) form error of each part of the response, by its standard deviation.
    """

    variance: np.ndarray
    form: np.ndarray

    def products(self, sides: np.ndarray) -> np.ndarray:
        """Return the products (c, c) of columns (q, c) in the inverse of the covariance (Woodbury's identity)."""
        weighed = sides / self.variance[:, None]
        across = self.form.T @ weighed
        return np.asarray(sides.T @ weighed - across.T @ np.linalg.solve(self._inner, across))

    @property
    def volume(self) -> float:
        """Logarithm of the determinant."""
        return float(np.log(self.variance).sum() + np.linalg.slogdet(self._inner)[1])

    @property
    def _inner(self) -> np.ndarray:
        scaled = self.form / np.sqrt(self.variance)[:, None]
        return np.asarray(np.eye(scaled.shape[1]) + scaled.T @ scaled)


def covariances_of_rest(
    residual: Residual, form: np.ndarray, size: float, priors: Priors, other: bool
) -> Iterator[CovarianceOfRest]:
    """Yield the covariance of what an effect leaves, for every form error and every size of an unknown effect.

    Args:
        residual: the residual.
        form: (q, g) what the effect does to each part of the row.
        size: whitened norm of what it does.
        priors: which shares of it its form may miss.
        other: whether there is an unknown effect besides.
    """
    for share, unknown in product(priors.form_error, SIZES if other else [0.0]):
        variance = 1 + ((share * size) ** 2 + unknown**2) / len(residual.value) * residual.spread
        yield CovarianceOfRest(variance, share * form)


def _evidence_by_part(
    residual: Residual, responses: Sequence[LinearResponse], other: bool, priors: Priors
) -> GaussianEvidence:
    """Return the same where the form error is a share of each part of the response, as strong as in the residual.

    The covariance is that of a form error e of each part by itself, and of the same share without structure:

        I + sum_k s_k^2 D_k D_k' + e^2 F F' + (e^2 |F|^2 + u^2) G

    F holds the parts of what all effects do together, at the strengths that come nearest to the residual: two that
    nearly cancel have no more form error than what is left of them.
    """
    columns = np.hstack([residual.columns_of(each) for each in responses])  # (q, p)
    own = np.array([each.columns.shape[1] for each in responses])
    ridge = np.eye(len(columns.T)) / _USUAL_SD**2
    strength = np.linalg.solve(columns.T @ columns + ridge, columns.T @ residual.value)
    ends = np.cumsum(own)[:-1]
    forms = [each.parts @ values for each, values in zip(responses, np.split(strength, ends), strict=True)]  # (g, q')
    form = residual.turn @ np.sum(forms, axis=0).T  # (q, g)
    size = np.linalg.norm(columns @ strength)
    sizes = np.array(list(product(*map(_sizes, responses))))  # (s, r)
    scales = np.repeat(sizes / [each.size for each in responses], own, axis=1)  # (s, p)
    ends_of = [np.vstack([each.low, each.high, each.bounds]) for each in responses]
    low, high, least, most = np.hstack(ends_of)[:, None] / scales
    bounded = log_mass(least, most)
    logs, best = [], (-np.inf, np.zeros((0, 0)), np.zeros(0))
    sides = np.column_stack([columns, residual.value])
    for rest in covariances_of_rest(residual, form, float(size), priors, other):
        gram = rest.products(sides)  # (p + 1, p + 1)
        precision = np.eye(len(strength)) + scales[:, :, None] * gram[:-1, :-1] * scales[:, None]
        along, covariance = scales * gram[:-1, -1], np.linalg.inv(precision)
        mean = (covariance @ along[:, :, None])[:, :, 0]
        squares = gram[-1, -1] + rest.volume - (along * mean).sum(axis=1)
        sd = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
        inside = (log_mass((low - mean) / sd, (high - mean) / sd) - bounded).sum(axis=1)
        found = -0.5 * (squares + np.linalg.slogdet(precision)[1]) + inside
        logs.append(found)
        if (most_likely := int(np.argmax(found))) >= 0 and found[most_likely] > best[0]:
            best = float(found[most_likely]), np.hstack([columns * scales[most_likely], rest.form]), rest.variance
    return GaussianEvidence(_mean(np.concatenate(logs)), best[1], best[2])


def log_mass(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return the log of the probability of a standard normal number between two ends, however far out they lie."""
    left, right = np.where(low > 0, -high, low), np.where(low > 0, -low, high)  # the tail that does not round to 1
    most = log_ndtr(right)
    return np.asarray(most + np.log1p(-np.exp(np.minimum(log_ndtr(left) - most, -_TINY))))


def _sizes(response: LinearResponse) -> np.ndarray:
    """Return the sizes that an effect may have within its bounds."""
    reach = float(np.abs(response.bounds).max()) * response.size
    return SIZES[max(reach, SIZES[0]) >= SIZES]


def _norms(
    residual: Residual,
    responses: Sequence[LinearResponse],
    columns: np.ndarray,
    whose: np.ndarray,
    sizes: np.ndarray,
) -> np.ndarray:
    """Return the norm of the effects before coefficients are refitted (s,).

    They are as strong as in the residual.
    """
    gram = sizes[:, :, None] * (columns.T @ columns) * sizes[:, None]
    covariance = np.linalg.inv(np.eye(len(whose)) + gram)
    mean = (covariance @ (sizes * (columns.T @ residual.value))[:, :, None])[:, :, 0]
    before = np.array([each.before_refit for each in responses])[whose] ** 2 if len(whose) else np.zeros(0)
    same = np.equal.outer(whose, whose) * before
    squares = (same * gram * (mean[:, :, None] * mean[:, None] + covariance)).sum(axis=(1, 2))
    return np.asarray(np.sqrt(squares))


def _mean(logs: Sequence[float] | np.ndarray) -> float:
    return float(np.logaddexp.reduce(logs) - np.log(len(logs))) if len(logs) else -np.inf


def _log_gain(products: np.ndarray) -> float:
    """Return the log Bayes factor of b more columns, all of one size.

    Args:
        products: (1 + b, 1 + b) of the residual and these columns, in the inverse of the covariance of the rest.
    """
    squares, turn = np.linalg.eigh(products[1:, 1:])
    along = turn.T @ products[1:, 0]
    grown = 1 + np.outer(SIZES**2, np.maximum(squares, 0.0))  # (s, b)
    return _mean(0.5 * (np.outer(SIZES**2, along**2) / grown - np.log(grown)).sum(axis=1))


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """All hypotheses of one residual.

    Attributes:
        like_any, loose: the residual against an unknown effect like any of the catalogue, and one without structure.
        effects: responses of the effects of the catalogue.
        priors: prior probabilities.
        not_features: where the whitened residual holds frequencies, creeps and free decays, which are no features.
        creeps: where it holds how fast markers slide aside of their neighbours.
        places: where an unknown effect may act: prior weight, and columns (k, b) in the whitened residual space.
    """

    like_any: Residual
    loose: Residual
    effects: Sequence[EffectResponse]
    priors: Priors
    not_features: slice = field(default_factory=lambda: slice(0, 0))
    creeps: slice = field(default_factory=lambda: slice(0, 0))
    places: tuple[tuple[float, np.ndarray], ...] = ()

    def evidence(self, present: Sequence[int], other: bool) -> float:
        """Return the log evidence of some effects, with or without an unknown one.

        For several effects the likeliest responses count, each with the share that it has of its effect alone.

        Args:
            present: numbers of the effects.
            other: whether there is an unknown effect besides.
        """
        if len(present) == 1:
            return self._of_effect(present[0], other)
        best = [self._best(i, other) for i in present]
        if any(each is None for each in best):
            return -np.inf
        responses = [each for each in best if each is not None]
        shares = sum(self._of_effect(i, other) - max(self._alone[other][i]) for i in present)
        return self._evidence(responses, other) + shares

    def at_places(self, present: Sequence[int]) -> np.ndarray:
        """Return the log evidence (n,) of some effects with an unknown one at each of n places.

        The effects have their likeliest sizes. With effects the unknown one is half as likely as alone.
        """
        responses = [each for each in (self.best[i] for i in present) if each is not None]
        if not self.places or len(responses) < len(present):
            return np.full(len(self.places), -np.inf)
        found = gaussian_evidence(self.like_any, responses, False, self.priors)
        rest, value = CovarianceOfRest(found.variance, found.columns), self.like_any.value
        gained = [_log_gain(rest.products(np.column_stack([value, own]))) for own in self._columns_at_places]
        weights = np.array([weight for weight, _ in self.places])
        prior = np.log(weights / weights.sum()) - np.log(2 if present else 1)
        shares = sum(self._of_effect(i, False) - max(self._alone[False][i]) for i in present)
        return np.asarray(found.evidence + prior + shares + gained)

    def look_alike_odds(self, effect: int, other: bool) -> float:
        """Return the odds that what looks like an effect is an unknown one which differs from it.

        Where it differs by too little to show, it counts without another unknown effect; where that shows, with one.
        But only clock and drive change frequencies, in each trial by as much as an effect says: not by chance. Nor does
        a marker slide aside of its neighbours by as much as an effect says.

        Args:
            effect: number of the effect.
            other: whether there is another unknown effect.
        """
        length, least = float(np.linalg.norm(self._changes[effect])), self.priors.differs
        unseen = float(np.clip(np.log(SHOWS / max(least * length, _TINY)) / -np.log(least), 0.0, 1.0))
        if not other:
            return self.priors.look_alike * unseen
        by_chance = self.priors.other / (1 - self.priors.other)
        odds = self.priors.look_alike_beside * (1 - unseen) * self._of_features(effect) / by_chance
        return odds * float(np.exp(-self._of_creeps(effect) / 2))

    def shows_in_features(self, name: str) -> bool:
        """Tell whether most of what an effect does is in features, not in frequencies or free decays."""
        return self._of_features([each.name for each in self.effects].index(name)) >= IN_FEATURES

    def shows_in_creeps(self, name: str) -> bool:
        """Tell whether markers surely slide aside of their neighbours as an effect says."""
        return self._of_creeps([each.name for each in self.effects].index(name)) >= IN_CREEPS

    def _of_features(self, effect: int) -> float:
        squares = self._changes[effect] ** 2
        return float(np.delete(squares, self.not_features).sum() / squares.sum()) if squares.sum() > _TINY else 1.0

    def _of_creeps(self, effect: int) -> float:
        """Return by how much an effect lessens the squared, whitened speeds aside of markers; 0 where it does not."""
        seen = (self.like_any.turn.T @ self.like_any.value)[self.creeps]
        left = seen - self._changes[effect][self.creeps]
        return max(float(seen @ seen - left @ left), 0.0)

    @cached_property
    def best(self) -> tuple[LinearResponse | None, ...]:
        """The likeliest response of each effect, with an unknown one if that is likely; None where it does nothing."""
        other = self.evidence((), other=True) > self.evidence((), other=False)
        return tuple(self._best(i, other) for i in range(len(self.effects)))

    def _best(self, effect: int, other: bool) -> LinearResponse | None:
        logs = self._alone[other][effect]
        return self.effects[effect].linear[int(np.argmax(logs))] if logs else None

    def _of_effect(self, effect: int, other: bool) -> float:
        """Return the log evidence of one effect: ranges of strengths add up, and all ways are equally likely."""
        ends = np.cumsum([len(way) for way in self.effects[effect].ways])[:-1]
        of_ways = np.split(np.array(self._alone[other][effect]), ends)
        return _mean([float(np.logaddexp.reduce(own)) for own in of_ways if len(own)])

    @cached_property
    def _alone(self) -> tuple[list[list[float]], list[list[float]]]:
        """Log evidence of each response of each effect alone, without and with an unknown effect."""

        def alone(other: bool) -> list[list[float]]:
            return [[self._evidence([response], other) for response in each.linear] for each in self.effects]

        return alone(other=False), alone(other=True)

    @cached_property
    def _columns_at_places(self) -> list[np.ndarray]:
        """Columns (q, b) of an unknown effect at each place, of norm 1."""
        turned = [self.like_any.turn @ columns for _, columns in self.places]
        return [each / max(float(np.linalg.norm(each)), _TINY) for each in turned]

    @cached_property
    def _changes(self) -> list[np.ndarray]:
        """Change (k,) that each effect alone makes, whitened, where it comes nearest to the residual."""
        seen, nothing = self.like_any, np.zeros(self.like_any.turn.shape[1])
        return [
            nothing if each is None else each.columns @ each.nearest(seen.value, seen.columns_of(each))
            for each in self.best
        ]

    def _evidence(self, responses: Sequence[LinearResponse], other: bool) -> float:
        residuals = (self.like_any, self.loose) if other else (self.like_any,)
        return _mean([gaussian_evidence(each, responses, other, self.priors).evidence for each in residuals])
