"""A row beside forms of effects that have a size: how probable it is, with what no form holds."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from diagnosis.forms import Form
from diagnosis.normal import Normal, log_mass
from diagnosis.row import Row

LITTLE = (0.05, 0.2)
"""Shares of what effects do, by which their forms may be wrong in one direction."""
MOST_WRONG = 40.0
"""Whitened length beyond which a form is no more wrong in all: what is left then is something else."""
_CLEARLY = 3.0  # log evidence from which something else counts, and so what is wrong with it


@dataclass(frozen=True, eq=False)
class Columns:
    """What some forms do in a row's directions, of a size of one.

    Attributes:
        parts: (q, p) of each form, of n columns in all.
        products: (n, n) of all columns with each other.
        against: (n,) of theirs with the row.
    """

    parts: tuple[np.ndarray, ...]
    products: np.ndarray
    against: np.ndarray

    @classmethod
    def of(cls, row: Row, forms: Sequence[Form]) -> "Columns":
        """Of forms beside a row."""
        parts = tuple(row.turn @ form.columns / form.size for form in forms)
        together = np.hstack([np.zeros((len(row.left), 0)), *parts])
        return cls(parts, together.T @ together, together.T @ row.left)


@dataclass(frozen=True, eq=False)
class Sized:
    """A row beside some forms, and something else, each of a size that is given.

    Attributes:
        row: that was seen.
        forms: of the effects that are there.
        columns: what these do in the row's directions.
        sizes: root mean square whitened length of what each does.
        other: the same of something else; 0 of none.
        unlike: share of what the forms do that they do not hold, in no particular direction.
    """

    row: Row
    forms: tuple[Form, ...]
    columns: Columns
    sizes: tuple[float, ...]
    other: float
    unlike: float

    @cached_property
    def evidence(self) -> float:
        """Its logarithm, with what no form holds in no particular direction; strengths stay where forms hold."""
        if not self.forms:
            return self._normal.log_density
        ends = [np.vstack([form.low, form.high, form.bounds]) * form.size for form in self.forms]
        low, high, least, most = np.hstack([end / size for end, size in zip(ends, self.sizes, strict=True)])
        mean, sd = self._normal.mean, np.sqrt(np.diag(np.linalg.inv(self._normal.precision)))
        within = log_mass((low - mean) / sd, (high - mean) / sd) - log_mass(least, most)
        return self._normal.log_density + float(within.sum())

    def gained(self, directions: np.ndarray, alike: float) -> float:
        """What is added where what no form holds has, with this probability, one of these directions (q, d)."""
        gains = np.concatenate([self._normal.gained(directions, share * self._raw) for share in LITTLE])
        return float(np.logaddexp(np.log1p(-alike), np.log(alike) + np.logaddexp.reduce(gains) - np.log(len(gains))))

    def beside(self, columns: np.ndarray, sizes: np.ndarray) -> np.ndarray:
        """(s,) what is added by something else that does this (q, b), of each of these sizes (s,).

        It too does not do quite what its columns say, by the share that forms have wrong.
        """
        gained, length = self._normal.gained_together(columns, sizes)
        if gained.max() < _CLEARLY:
            return gained
        wrong = replace(self, other=self.unlike * min(length, MOST_WRONG))
        return np.asarray(wrong.evidence - self.evidence + wrong._normal.gained_together(columns, sizes)[0])

    def apart(self, in_trials: Sequence[np.ndarray]) -> float:
        """What is added where forms have other strengths in each trial, by as much as they have in all.

        Args:
            in_trials: (q, t p) of each form, what each trial's gait has of its columns, in this row's directions.
        """
        parts, first = [np.zeros((len(self.row.left), 0))], 0
        for form, size, columns, own in zip(self.forms, self.sizes, self.columns.parts, in_trials, strict=True):
            strengths = self._normal.mean[first : (first := first + columns.shape[1])]
            parts.append(float(np.sqrt(np.mean(strengths**2))) * size / form.size * own)
        gained, _ = self._normal.gained_together(np.hstack(parts), np.ones(1))
        return float(gained[0])

    @cached_property
    def _normal(self) -> Normal:
        """Unit noise, columns of these sizes, and what no form holds."""
        unlike = ((self.unlike * self._raw) ** 2 + self.other**2) / len(self.row.left)
        return Normal(self.row.left, 1 + unlike * self.row.spread, self._scaled)

    @cached_property
    def _scaled(self) -> np.ndarray:
        """(q, p) columns of all forms, with these sizes."""
        own = [size * part for size, part in zip(self.sizes, self.columns.parts, strict=True)]
        return np.hstack([np.zeros((len(self.row.left), 0)), *own])

    @cached_property
    def _raw(self) -> float:
        """Length of what the forms do, before coefficients are refitted, as strong as the row has them, or a limit.

        Not as strong as they might be: else a form that does next to nothing would have much wrong with it.
        """
        sizes = np.repeat(self.sizes, [part.shape[1] for part in self.columns.parts])
        products = sizes[:, None] * self.columns.products * sizes
        around = np.linalg.inv(np.eye(len(sizes)) + products)  # of the strengths, beside unit noise
        mean = around @ (sizes * self.columns.against)
        squares, first = 0.0, 0
        for form, part in zip(self.forms, self.columns.parts, strict=True):
            own = slice(first, first := first + part.shape[1])
            squares += form.raw**2 * float(
                mean[own] @ products[own, own] @ mean[own] + (products[own, own] * around[own, own]).sum()
            )
        return min(float(np.sqrt(squares)), MOST_WRONG)
