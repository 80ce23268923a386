"""How probable a whitened row is under each explanation: nothing, effects of the catalogue, or something else.

Every explanation is normal: nothing leaves unit noise; an effect adds its columns, its strength normal about zero with
a size that is not known (uniform in its logarithm, from what is just seen to what its bounds allow); and what shows is
never quite what a form says, by a share of its own length in no particular direction. Something else is a gap in no
particular direction of a size that is not known. So all evidences are closed (Rasmussen and Williams 2006, chapter 5),
and forms with more freedom pay for it by themselves.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import comb

import numpy as np
from scipy.special import log_ndtr, logsumexp

from diagnosis.forms import Form, Shown
from fitting.signatures import Whitened

SIZES = np.geomspace(1.0, 1024.0, 11)  # root mean square whitened length of what an effect does
_LOOSE = 0.3
_ROUNDS = 4  # of the search for the likeliest sizes


@dataclass(frozen=True)
class Belief:
    """What is believed before a session is looked at; fitted to sessions of development (see docs/diagnosis.md).

    Attributes:
        unlike: share of what an effect does that its form does not hold.
        number: prior probabilities of none, one, two … effects.
        other: prior probability that there is something else, beside whatever effects.
    """

    unlike: float = 0.25
    number: tuple[float, ...] = (0.5, 0.38, 0.1, 0.015, 0.005)
    other: float = 0.1

    def log_prior(self, present: int, other: bool, effects: int) -> float:
        """Of one set of so many effects out of all."""
        chance = self.number[present] / comb(effects, present)
        return float(np.log(chance) + np.log(self.other if other else 1 - self.other))


@dataclass(frozen=True, eq=False)
class Row:
    """A whitened row in directions in which a gap of no particular cause has no correlation.

    Attributes:
        turn: (q, k) from the whitened row.
        left: (q,) what is left.
        spread: (q,) variance of a gap of no particular cause, of mean 1.
    """

    turn: np.ndarray
    left: np.ndarray
    spread: np.ndarray

    @classmethod
    def of(cls, space: Whitened, left: np.ndarray, generic: np.ndarray, effects: Sequence[Shown] = ()) -> "Row":
        """Of what is left (k,).

        A gap of no particular cause has no structure but that of `generic` (k, k); where effects are given, it is like
        any of these (each as likely), but for the share `_LOOSE` of its variance.
        """
        values, vectors = np.linalg.eigh(generic)
        loose = space.freed((vectors * np.sqrt(np.maximum(values, 0.0))).T).T  # (q, k)
        tight = [form.columns / form.size for each in effects for form in each.forms[:2]]
        share = _LOOSE if tight else 1.0
        parts = [np.sqrt(share) * loose / np.linalg.norm(loose)]
        parts += [np.sqrt((1 - share) / len(tight)) * part for part in tight]
        turn, singular, _ = np.linalg.svd(np.hstack(parts), full_matrices=False)
        inside = singular > 1e-9 * singular[0]
        spread = singular[inside] ** 2
        turn = turn[:, inside].T
        return cls(turn, turn @ space.freed(left), spread / spread.mean())

    @property
    def squares(self) -> float:
        """Squared length of what is left; of mean q where there is nothing."""
        return float(self.left @ self.left)


@dataclass(frozen=True, eq=False)
class Explanations:
    """All explanations of one row.

    Attributes:
        rows: the row to be explained, for each way in which a gap of no particular cause may be; all as likely.
        effects: that may explain it.
        belief: before the row.
    """

    rows: tuple[Row, ...]
    effects: Sequence[Shown]
    belief: Belief

    @property
    def row(self) -> Row:
        """The first."""
        return self.rows[0]

    def evidence(self, present: Sequence[int], other: bool) -> float:
        """Log evidence of some effects, each in its best form, with or without something else beside them."""
        if not present:
            return self._over_sizes((), other)
        alone = [self._alone[other][i] for i in present]
        if len(present) == 1:
            return _mean(alone[0])
        if not all(alone):
            return -np.inf
        best = tuple(self.effects[i].forms[int(np.argmax(logs))] for i, logs in zip(present, alone, strict=True))
        gained = sum(max(logs) - _mean(logs) for logs in alone)  # by choosing the best of several forms
        return self._over_sizes(best, other) - gained

    @cached_property
    def best(self) -> tuple[Form | None, ...]:
        """The form of each effect that explains most; None where it does nothing.

        Beside something else where there is likely to be something else.
        """
        other = self._over_sizes((), other=True) > self._over_sizes((), other=False)
        return tuple(
            each.forms[int(np.argmax(logs))] if logs else None
            for each, logs in zip(self.effects, self._alone[other], strict=True)
        )

    @cached_property
    def _alone(self) -> dict[bool, list[list[float]]]:
        """Log evidence of each form of each effect by itself, without and with something else."""
        return {
            other: [[self._over_sizes((form,), other) for form in each.forms] for each in self.effects]
            for other in (False, True)
        }

    def _over_sizes(self, forms: tuple[Form, ...], other: bool) -> float:
        """Log evidence, averaged over the sizes of the forms and of something else, whichever way that may be."""
        return _mean([self._in(row, forms, other) for row in (self.rows if other else self.rows[:1])])

    def _in(self, row: Row, forms: tuple[Form, ...], other: bool) -> float:
        """The same of one way.

        Over one size in full; over more along each axis through the likeliest point, as if they were independent there.
        """
        axes = [_sizes(form) for form in forms] + ([SIZES] if other else [])
        if not axes:
            return self._at(row, (), (), 0.0)
        columns = tuple(row.turn @ form.columns / form.size for form in forms)

        def at(point: list[int]) -> float:
            sizes = tuple(float(axis[i]) for axis, i in zip(axes, point, strict=True))
            return self._at(row, columns, sizes[: len(forms)], sizes[-1] if other else 0.0, forms)

        point = [len(axis) // 2 for axis in axes]
        for _ in range(_ROUNDS if len(axes) > 1 else 1):
            before, along = list(point), []
            for number, axis in enumerate(axes):
                lines = [at([*point[:number], i, *point[number + 1 :]]) for i in range(len(axis))]
                point[number] = int(np.argmax(lines))
                along.append(lines)
            if before == point:
                break
        top = max(along[-1])
        return float(top + sum(_mean(lines) - max(lines) for lines in along))

    def _at(
        self,
        row: Row,
        columns: tuple[np.ndarray, ...],
        sizes: tuple[float, ...],
        other: float,
        forms: tuple[Form, ...] = (),
    ) -> float:
        """Log evidence where what is left is normal: unit noise, columns of these sizes, and what no form holds."""
        raw = sum((size * form.raw) ** 2 for size, form in zip(sizes, forms, strict=True))
        unlike = (self.belief.unlike**2 * raw + other**2) / len(row.left)
        variance = 1 + unlike * row.spread
        found = _normal(row.left, variance)
        if not columns:
            return found
        scaled = np.hstack([size * part for size, part in zip(sizes, columns, strict=True)])
        weighted = scaled / variance[:, None]
        precision = np.eye(scaled.shape[1]) + scaled.T @ weighted
        against = weighted.T @ row.left
        mean = np.linalg.solve(precision, against)
        found += 0.5 * float(against @ mean) - 0.5 * float(np.linalg.slogdet(precision)[1])
        first = 0
        for form in forms:
            if form.one_sided:
                sign = 1.0 if form.high[0] > 0 else -1.0
                sd = np.sqrt(np.linalg.inv(precision)[first, first])
                found += np.log(2.0) + float(log_ndtr(sign * mean[first] / sd))
            first += len(form.sd)
        return found


def _sizes(form: Form) -> np.ndarray:
    """Of what a form does, as far as its bounds allow."""
    reach = float(np.maximum(np.abs(form.low), np.abs(form.high)).max()) * form.size
    return np.asarray([size for size in SIZES if size <= max(reach, SIZES[0])])


def _normal(left: np.ndarray, variance: np.ndarray) -> float:
    """Log density but for (2 pi)^(q/2)."""
    return float(-0.5 * (left**2 / variance + np.log(variance)).sum())


def _mean(logs: list[float]) -> float:
    return float(logsumexp(logs) - np.log(len(logs))) if logs else -np.inf
