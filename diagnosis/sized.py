"""A row beside forms of effects that have a size: how probable it is, with what no form holds."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import logsumexp

from diagnosis.constants import LITTLE, MOST_WRONG, SOMETHING_ELSE
from diagnosis.forms import Form
from diagnosis.normal import Normal, log_mass, of_sizes
from diagnosis.row import Row


@dataclass(frozen=True, eq=False)
class Columns:
    """What f forms do in a row's directions, of a size of one; for many sizes at once it says how probable the row is.

    Attributes:
        row: that was seen.
        forms: of the effects that are there.
        every: (q, n) columns of all forms, side by side.
        whose: (n,) number of the form that each belongs to.
    """

    row: Row
    forms: tuple[Form, ...]
    every: np.ndarray
    whose: np.ndarray

    @classmethod
    def of(cls, row: Row, forms: Sequence[Form]) -> "Columns":
        """Of forms beside a row."""
        parts = [row.turn @ form.columns / form.size for form in forms]
        whose = np.repeat(np.arange(len(parts)), [part.shape[1] for part in parts])
        return cls(row, tuple(forms), np.hstack([np.zeros((len(row.left), 0)), *parts]), whose)

    def evidences(self, sizes: np.ndarray, other: np.ndarray, unlike: float) -> np.ndarray:
        """(s,) log probabilities of the row beside forms of sizes (s, f) and something else of sizes (s,).

        With what no form holds in no particular direction; strengths stay where forms hold. But for (2 pi)^(q/2).
        """
        own, variance = sizes[:, self.whose], 1 + np.outer(self.unlike(sizes, other, unlike), self.row.spread)
        found = of_sizes(self.row.left, variance, self.every, own)
        low, high, least, most = self._ends[:, None] / own
        sd = np.sqrt(np.diagonal(found.covariance, axis1=1, axis2=2))
        within = log_mass((low - found.mean) / sd, (high - found.mean) / sd) - log_mass(least, most)
        return np.asarray(found.log_density + within.sum(axis=1))

    def unlike(self, sizes: np.ndarray, other: np.ndarray, share: float) -> np.ndarray:
        """(s,) variance, in no particular direction, of what forms of sizes (s, f) do not hold and something else."""
        return np.asarray(((share * self.lengths(sizes)) ** 2 + other**2) / len(self.row.left))

    def lengths(self, sizes: np.ndarray) -> np.ndarray:
        """(s,) of what forms of sizes (s, f) do, before coefficients are refitted, as strong as the row has them.

        Or a limit; not as strong as they might be: else a form that does next to nothing would have much wrong with it.
        """
        own = sizes[:, self.whose]
        products = own[:, :, None] * self._products * own[:, None]
        around = np.linalg.inv(np.eye(own.shape[1]) + products)  # of the strengths, beside unit noise
        mean = (around @ (own * self._against)[:, :, None])[:, :, 0]
        squares = (self._raw * products * (mean[:, :, None] * mean[:, None] + around)).sum(axis=(1, 2))
        return np.minimum(np.sqrt(squares), MOST_WRONG)

    @cached_property
    def _products(self) -> np.ndarray:
        return np.asarray(self.every.T @ self.every)

    @cached_property
    def _against(self) -> np.ndarray:
        return np.asarray(self.every.T @ self.row.left)

    @cached_property
    def _raw(self) -> np.ndarray:
        """(n, n) square of how long what a form does is before coefficients are refitted, against after; 0 between."""
        raw = np.array([form.raw for form in self.forms])
        return np.equal.outer(self.whose, self.whose) * (raw**2)[self.whose]

    @cached_property
    def _ends(self) -> np.ndarray:
        """(4, n) of each column's stretch, and of what its parameter may be at all."""
        ends = [np.vstack([form.low, form.high, form.bounds]) * form.size for form in self.forms]
        return np.hstack([np.zeros((4, 0)), *ends])


@dataclass(frozen=True, eq=False)
class Sized:
    """A row beside some forms, and something else, each of a size that is given.

    Attributes:
        columns: what the forms do in the row's directions.
        sizes: root mean square whitened length of what each does.
        other: the same of something else; 0 of none.
        unlike: share of what the forms do that they do not hold, in no particular direction.
    """

    columns: Columns
    sizes: tuple[float, ...]
    other: float
    unlike: float

    @cached_property
    def evidence(self) -> float:
        """Log probability of the row."""
        return float(self.columns.evidences(*self._one, self.unlike)[0])

    def gained(self, directions: np.ndarray, alike: float) -> float:
        """What is added where what no form holds has, with this probability, one of these directions (q, d)."""
        length = float(self.columns.lengths(self._one[0])[0])
        gains = self._normal.gained(directions, length * np.array(LITTLE))
        return float(np.logaddexp(np.log1p(-alike), np.log(alike) + logsumexp(gains) - np.log(gains.size)))

    def beside(self, columns: np.ndarray, sizes: np.ndarray) -> np.ndarray:
        """(s,) what is added by something else that does this (q, b), of each of these sizes (s,).

        It too does not do quite what its columns say, by the share that forms have wrong.
        """
        gained, length = self._normal.gained_together(columns, sizes)
        if gained.max() < SOMETHING_ELSE:
            return gained
        wrong = replace(self, other=self.unlike * min(length, MOST_WRONG))
        return np.asarray(wrong.evidence - self.evidence + wrong._normal.gained_together(columns, sizes)[0])

    @property
    def _one(self) -> tuple[np.ndarray, np.ndarray]:
        """(1, f) and (1,) sizes."""
        return np.array(self.sizes)[None], np.array([self.other])

    @cached_property
    def _normal(self) -> Normal:
        """Unit noise, columns of these sizes, and what no form holds."""
        row, columns = self.columns.row, self.columns
        variance = 1 + float(columns.unlike(*self._one, self.unlike)[0]) * row.spread
        return Normal(row.left, variance, columns.every * self._one[0][0, columns.whose])
