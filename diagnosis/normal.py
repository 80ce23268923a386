"""A row of numbers as a normal distribution: a variance of each number, and columns of random strength."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.special import log_ndtr

_TINY = 1e-12


@dataclass(frozen=True, eq=False)
class Normal:
    """Beside a row that was seen; of mean zero (Rasmussen and Williams 2006, section 2.1).

    Attributes:
        row: (q,) that was seen.
        variance: (q,) of each number by itself.
        columns: (q, p) whose strengths are normal, of unit size.
    """

    row: np.ndarray
    variance: np.ndarray
    columns: np.ndarray

    @cached_property
    def precision(self) -> np.ndarray:
        """(p, p) of the strengths, after the row."""
        return np.asarray(np.eye(self.columns.shape[1]) + self.columns.T @ self._weighted)

    @cached_property
    def mean(self) -> np.ndarray:
        """(p,) of the strengths, after the row."""
        return np.linalg.solve(self.precision, self._against)

    def gained(self, more: np.ndarray, sizes: np.ndarray) -> np.ndarray:
        """(s, d) what each of more columns (q, d) by itself, of strengths of these sizes (s,), would add to it."""
        weighted = more / self.variance[:, None]
        shared = self._weighted.T @ more  # (p, d)
        length = (more * weighted).sum(axis=0) - (shared * np.linalg.solve(self.precision, shared)).sum(axis=0)
        along = weighted.T @ self.row - shared.T @ self.mean
        grown = 1 + np.outer(sizes**2, length)
        return np.asarray(0.5 * np.outer(sizes**2, along**2) / grown - 0.5 * np.log(grown))

    def gained_together(self, more: np.ndarray, sizes: np.ndarray) -> tuple[np.ndarray, float]:
        """(s,) what more columns (q, d) all together, of strengths of each of these sizes (s,), would add to it.

        And how long what they then do is at the likeliest size.
        """
        weighted = more / self.variance[:, None]
        shared = self._weighted.T @ more  # (p, d)
        gram = more.T @ weighted - shared.T @ np.linalg.solve(self.precision, shared)
        lengths, turn = np.linalg.eigh(gram)
        along = turn.T @ (weighted.T @ self.row - shared.T @ self.mean)
        grown = 1 + np.outer(sizes**2, np.maximum(lengths, 0.0))  # (s, d)
        gained = 0.5 * (np.outer(sizes**2, along**2) / grown - np.log(grown)).sum(axis=1)
        best = int(np.argmax(gained))
        return gained, float(np.linalg.norm(more @ (turn @ (sizes[best] ** 2 * along / grown[best]))))

    @cached_property
    def _weighted(self) -> np.ndarray:
        return self.columns / self.variance[:, None]

    @cached_property
    def _against(self) -> np.ndarray:
        return np.asarray(self._weighted.T @ self.row)


class Strengths(NamedTuple):
    """Of columns beside a row, for each of s sizes that they may have.

    Attributes:
        log_density: (s,) of the row, but for (2 pi)^(q/2).
        mean: (s, p) of the strengths, after the row, each of unit size before.
        covariance: (s, p, p) of them.
    """

    log_density: np.ndarray
    mean: np.ndarray
    covariance: np.ndarray


def of_sizes(row: np.ndarray, variance: np.ndarray, columns: np.ndarray, sizes: np.ndarray) -> Strengths:
    """Of a row (q,) with variances (s, q), and columns (q, p) of sizes (s, p): all at once."""
    weighted = np.swapaxes(columns / variance[:, :, None], 1, 2)  # (s, p, q)
    precision = np.eye(columns.shape[1]) + sizes[:, :, None] * (weighted @ columns) * sizes[:, None]
    against, covariance = sizes * (weighted @ row), np.linalg.inv(precision)
    mean = (covariance @ against[:, :, None])[:, :, 0]
    alone = (row**2 / variance + np.log(variance)).sum(axis=1)
    beside = (against * mean).sum(axis=1) - np.linalg.slogdet(precision)[1]
    return Strengths(-0.5 * (alone - beside), mean, covariance)


def log_mass(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Logarithm of how probable a standard normal number is between two ends, however far out they lie."""
    left, right = np.where(low > 0, -high, low), np.where(low > 0, -low, high)  # the tail that does not round to 1
    most = log_ndtr(right)
    return np.asarray(most + np.log1p(-np.exp(np.minimum(log_ndtr(left) - most, -_TINY))))
