"""How probable a whitened row is under each explanation: nothing, effects of the catalogue, or something else.

Every explanation is normal: nothing leaves unit noise; an effect adds its columns, its strength normal about zero with
a size that is not known (uniform in its logarithm, from what is just seen to what its bounds allow), its columns those
of the stretch in which the strength lies; and what shows is never quite what a form says, by a share of its own length
in no particular direction, and perhaps by what looks like a little of another effect, for that is likelier than one
more effect. Something else is a gap of a size that is not known: in no particular direction, or at one place; and it
may move the fish beside its beat as well, or make beats late, of which the row does not tell. So evidences are formulas
(Rasmussen and Williams 2006, chapter 5), and forms with more freedom pay for it by themselves. Approximate are five
things: several sizes count as independent about the likeliest, bounds are held parameter by parameter, what a form has
wrong is taken at the strength that the row has, of effects that act together only the likeliest stretches count, and
what is at one place is weighed beside effects of the sizes that are likeliest without it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from math import comb

import numpy as np
from scipy.special import logsumexp

from diagnosis.constants import IN_FEATURES, SHOWS, SIZES
from diagnosis.forms import Form, Shown
from diagnosis.row import Row
from diagnosis.sized import Columns, Sized

_SILENT = 1e-9
_ROUNDS = 4  # of the search for the likeliest sizes


@dataclass(frozen=True)
class Priors:
    """What is believed before a session is looked at; fitted to sessions of development (see docs/benchmarks.md).

    Attributes:
        unlike: share of what an effect does that its form does not hold, in no particular direction.
        alike: probability that its form is also wrong by what looks like a little of some effect.
        number: prior probabilities of none, one, two … effects.
        other: prior probability that there is something else, beside whatever effects.
        placed: of that, that it is at one place.
        besides: of that, that it shows beside the beat too; in either way as likely.
        imitated: odds, against an effect, that something outside the catalogue looks like it.
        strays: least share of its own length by which what looks like an effect strays from it; at most all of it, and
            as likely in each octave between.
    """

    unlike: float = 0.25
    alike: float = 0.5
    number: tuple[float, ...] = (0.5, 0.38, 0.1, 0.015, 0.005)
    other: float = 0.1
    placed: float = 0.4
    besides: float = 0.3
    imitated: float = 0.3
    strays: float = 0.05

    def log_prior(self, present: int, other: bool, effects: int) -> float:
        """Of one set of so many effects out of all."""
        chance = self.number[present] / comb(effects, present)
        return float(np.log(chance) + np.log(self.other if other else 1 - self.other))


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """All hypotheses of one row.

    Attributes:
        rows: the row to be explained: first with what forms have wrong, then for each way in which something else may
            be; all as likely.
        effects: that may explain it.
        priors: before the row.
        numbers: where the whitened row holds what is beside the features: frequencies, and how free decays ring.
        places: where something else may be: how likely against each other, and (q, b) what it does to the whitened row.
        beside: by which the tracks speak for a motion beside the beat, and for beats that are late (log Bayes
            factors), see `diagnosis.non_periodic`.
        lacking: the second of the rows, of a gap like what all effects do, with one of them left out.
    """

    rows: tuple[Row, ...]
    effects: Sequence[Shown]
    priors: Priors
    numbers: slice = field(default_factory=lambda: slice(0, 0))
    places: tuple[tuple[float, np.ndarray], ...] = ()
    beside: tuple[float, ...] = (0.0,)
    lacking: Callable[[int], Row] | None = None

    @property
    def row(self) -> Row:
        """The first."""
        return self.rows[0]

    @property
    def non_periodic(self) -> float:
        """What shows beside the beat adds to the log evidence of something else, which may make some or none."""
        return float(np.logaddexp(np.log1p(-self.priors.besides), logsumexp(self._each_beside)))

    @property
    def showing_beside(self) -> tuple[float, ...]:
        """Probabilities that something else shows beside the beat, in each way, where there is something else."""
        return tuple(np.exp(self._each_beside - self.non_periodic).tolist())

    @property
    def _each_beside(self) -> np.ndarray:
        return np.log(self.priors.besides / len(self.beside)) + np.array(self.beside)

    def evidence(self, present: Sequence[int], other: bool) -> float:
        """Log evidence of some effects, each in its best form, with or without something else beside them."""
        return self._of_features(present, other) + (self.non_periodic if other else 0.0)

    def _of_features(self, present: Sequence[int], other: bool) -> float:
        if not present:
            return self._over_sizes((), other)
        alone = [self._alone(other)[i] for i in present]
        if not all(alone):
            return -np.inf
        total = [_of_ways(self.effects[i], logs) for i, logs in zip(present, alone, strict=True)]
        if len(present) == 1:
            return total[0]
        best = tuple(self.effects[i].forms[int(np.argmax(logs))] for i, logs in zip(present, alone, strict=True))
        chosen = sum(max(logs) - of_all for logs, of_all in zip(alone, total, strict=True))
        return self._over_sizes(best, other) - chosen

    def somewhere(self, present: Sequence[int]) -> np.ndarray:
        """(n,) log evidence of some effects with something else at each of n places, which `evidence` leaves out.

        Beside effects that is half as likely as alone.

        What is added to what the effects alone explain is taken at their likeliest sizes, and stands in the place of
        what their forms have wrong in one direction.
        """
        forms = tuple(form for form in (self.best[i] for i in present) if form is not None)
        if not self.places or len(forms) < len(present):
            return np.full(len(self.places), -np.inf)
        likeliest, alone = self._around(self.row, forms, False)
        weights = np.array([weight for weight, _ in self.places])
        at_places = np.log(weights / weights.sum()) + [_mean(list(likeliest.beside(p, SIZES))) for p in self._placed]
        alone -= float(sum(np.log(len(self.effects[i].ways)) for i in present))
        return np.asarray(alone + self.non_periodic - np.log(2 if forms else 1) + at_places)

    def mixed(self, present: tuple[int, ...], without: int | None = None) -> float:
        """Log evidence of some effects beside a mixture of what all do, or all but one; without what forms have wrong.

        -inf where some effect does nothing.
        """
        row = self.rows[1] if without is None or self.lacking is None else self.lacking(without)
        return self._beside_gap(row, present)

    def loose(self, present: tuple[int, ...]) -> float:
        """The same beside a gap that has no structure."""
        return self._beside_gap(self.rows[2], present)

    def _beside_gap(self, row: Row, present: tuple[int, ...]) -> float:
        forms = tuple(form for form in (self.best[i] for i in present) if form is not None)
        return -np.inf if len(forms) < len(present) else self._around(row, forms, True)[1]

    def unseen(self, effect: int) -> float:
        """Probability that something which looks like an effect strays too little from it to show."""
        length, least = float(np.linalg.norm(self.row.turn @ self._moved[effect])), self.priors.strays
        return float(np.clip(np.log(SHOWS / max(least * length, _SILENT)) / -np.log(least), 0.0, 1.0))

    def shows_in_features(self, name: str) -> bool:
        """Whether what an effect does is mostly in features.

        Frequencies are changed by clock and drive alone, in each trial by as much as the effect says: not by chance.
        """
        return self.of_features([each.name for each in self.effects].index(name)) >= IN_FEATURES

    def of_features(self, effect: int) -> float:
        """Share of the squared length of what an effect does that is in features, not in the numbers beside them."""
        squares = self._moved[effect] ** 2
        if squares.sum() < _SILENT:
            return 1.0
        return float(np.delete(squares, self.numbers).sum() / squares.sum())

    @cached_property
    def _moved(self) -> tuple[np.ndarray, ...]:
        """(q,) of the whitened row, what each effect does in its best form where it comes nearest to what is left."""
        turn, left = self.row.turn, self.row.left
        return tuple(
            np.zeros(turn.shape[1]) if form is None else form.columns @ form.nearest(left, turn @ form.columns)
            for form in self.best
        )

    @cached_property
    def best(self) -> tuple[Form | None, ...]:
        """The form of each effect that explains most; None where it does nothing.

        Beside something else where there is likely to be something else.
        """
        other = self.evidence((), other=True) > self.evidence((), other=False)
        return tuple(
            each.forms[int(np.argmax(logs))] if logs else None
            for each, logs in zip(self.effects, self._alone(other), strict=True)
        )

    def _alone(self, other: bool) -> list[list[float]]:
        """Log evidence of each form of each effect by itself, without or with something else."""
        return self._alone_beside if other else self._alone_without

    @cached_property
    def _alone_without(self) -> list[list[float]]:
        return [[self._over_sizes((form,), False) for form in each.forms] for each in self.effects]

    @cached_property
    def _alone_beside(self) -> list[list[float]]:
        return [[self._over_sizes((form,), True) for form in each.forms] for each in self.effects]

    def _over_sizes(self, forms: tuple[Form, ...], other: bool) -> float:
        """Log evidence, averaged over the sizes of the forms and of something else, whichever way that may be."""
        return _mean([self._in(row, forms, other) for row in (self.rows[1:] if other else self.rows[:1])])

    def _in(self, row: Row, forms: tuple[Form, ...], other: bool) -> float:
        """The same of one way.

        Over one size in full; over more along each axis through the likeliest point, as if they were independent there.
        """
        likeliest, evidence = self._around(row, forms, other)
        return evidence + (likeliest.gained(self._directions[row], self.priors.alike) if forms else 0.0)

    def _around(self, row: Row, forms: tuple[Form, ...], other: bool) -> tuple[Sized, float]:
        """With the likeliest sizes, and the log evidence over all, forms being right but in no particular direction."""
        axes = [_sizes(form) for form in forms] + ([SIZES] if other else [])
        columns, unlike = Columns.of(row, forms), self.priors.unlike

        def sizes(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            every = np.array([axis[places] for axis, places in zip(axes, points.T, strict=True)]).reshape(
                -1, len(points)
            )
            return every[: len(forms)].T, every[-1] if other else np.zeros(len(points))

        @cache  # the last lines are gone along twice
        def line(number: int, *point: int) -> np.ndarray:
            points = np.tile(point, (len(axes[number]), 1))
            points[:, number] = np.arange(len(points))
            return columns.evidences(*sizes(points), unlike)

        point = [len(axis) // 2 for axis in axes]
        along: list[np.ndarray] = []
        for _ in range(_ROUNDS if len(axes) > 1 else len(axes)):
            before, along = list(point), []
            for number in range(len(axes)):
                along.append(line(number, *point[:number], 0, *point[number + 1 :]))
                point[number] = int(np.argmax(along[-1]))
            if before == point:
                break
        (of_forms,), (of_other,) = sizes(np.array([point], int))
        likeliest = Sized(columns, tuple(map(float, of_forms)), float(of_other), unlike)
        if not along:
            return likeliest, likeliest.evidence
        return likeliest, float(max(along[-1]) + sum(_mean(list(each)) - max(each) for each in along))

    @cached_property
    def _placed(self) -> tuple[np.ndarray, ...]:
        """(q, b) what something else does at each place in the first row, of a length of one in all."""
        turned = (self.row.turn @ part for _, part in self.places)
        return tuple(part / max(float(np.linalg.norm(part)), _SILENT) for part in turned)

    @cached_property
    def _directions(self) -> dict[Row, np.ndarray]:
        """(q, d) in each row, of unit length, what each parameter of each effect does."""
        found = {}
        for row in self.rows:
            columns = row.turn @ np.hstack([each.slopes for each in self.effects if each.ways])
            found[row] = columns / np.maximum(np.linalg.norm(columns, axis=0), _SILENT)
        return found


def _sizes(form: Form) -> np.ndarray:
    """Of what a form does, as far as its bounds allow."""
    reach = float(np.abs(form.bounds).max()) * form.size
    return np.asarray([size for size in SIZES if size <= max(reach, SIZES[0])])


def _of_ways(effect: Shown, logs: list[float]) -> float:
    """Log evidence of an effect from those of its forms: these add up within a way, and all ways are as likely."""
    ends = np.cumsum([len(way) for way in effect.ways])[:-1]
    return _mean([float(np.logaddexp.reduce(own)) for own in np.split(np.array(logs), ends)])


def _mean(logs: list[float]) -> float:
    return float(np.logaddexp.reduce(logs) - np.log(len(logs))) if logs else -np.inf
