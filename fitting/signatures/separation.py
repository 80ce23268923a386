"""How far what an effect does lies from what its rivals could do, in standard deviations of all that disturbs it."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import lsq_linear

from fitting.signatures.signature import Signature
from fitting.signatures.slopes import ways


class Together(NamedTuple):
    """Several effects, or none, at their best.

    Attributes:
        values: (p,) of the parameters of each.
        distance: whitened, coefficients refitted; d in the two-way error Phi(-d / 2).
        residual: (k,) of the row without them, coefficients as they were.
    """

    values: list[np.ndarray]
    distance: float
    residual: np.ndarray


@dataclass(frozen=True, eq=False)
class Whitened:
    """A space in which all that disturbs a session's row of k numbers has unit size and coefficients are free.

    The row holds the features of t trials, and then the numbers beside them.

    Attributes:
        root: (k, k) lower Cholesky factor of the covariance of noise, nuisances and the twin's own discrepancy.
        slopes: (k, 5) of the row with the coefficients.
        precision: (5,) of the prior of the coefficients.
    """

    root: np.ndarray
    slopes: np.ndarray
    precision: np.ndarray

    @classmethod
    def of(cls, covariance: np.ndarray, slopes: np.ndarray, prior_sd: np.ndarray) -> "Whitened":
        """From a covariance (k, k), slopes (k, 5) and the prior's standard deviations (5,)."""
        return cls(np.linalg.cholesky(covariance), slopes, prior_sd**-2.0)

    def projected(self, rows: np.ndarray) -> np.ndarray:
        """(..., k + 5) rows (..., k), whitened, with what coefficients can take away taken; lengths are distances."""
        white = solve_triangular(self.root, rows.reshape(-1, rows.shape[-1]).T, lower=True)  # (k, q)
        slopes = np.vstack([solve_triangular(self.root, self.slopes, lower=True), np.diag(np.sqrt(self.precision))])
        white = np.vstack([white, np.zeros((len(self.precision), white.shape[1]))])
        residual = white - slopes @ np.linalg.lstsq(slopes, white, rcond=None)[0]
        return residual.T.reshape(*rows.shape[:-1], -1)

    @cached_property
    def log_volume(self) -> float:
        """What the logarithm of a row's density has beside half the square of its length, but for a constant."""
        white = solve_triangular(self.root, self.slopes, lower=True)
        freedom = np.diag(self.precision) + white.T @ white
        of_prior = 0.5 * float(np.log(self.precision).sum())
        return of_prior - float(np.log(np.diag(self.root)).sum()) - 0.5 * float(np.linalg.slogdet(freedom)[1])

    def moved(self, change: np.ndarray) -> float:
        """By how much a change (5,) of the coefficients moves the row, with the prior's distance."""
        moved = solve_triangular(self.root, self.slopes @ change, lower=True)
        return float(np.sqrt(moved @ moved + self.precision @ change**2))

    def coefficients(self, row: np.ndarray) -> np.ndarray:
        """(5,) by how much coefficients, held back by their prior, best make up for a change (k,)."""
        white, slopes = (solve_triangular(self.root, part, lower=True) for part in (row, self.slopes))
        return np.linalg.solve(slopes.T @ slopes + np.diag(self.precision), slopes.T @ white)

    def length(self, row: np.ndarray) -> float:
        """From the plain twin, refitted, of a change (k,)."""
        return float(np.linalg.norm(self.projected(row)))

    def together(self, row: np.ndarray, signatures: Sequence[Signature]) -> Together:
        """Parameters of effects that together come nearest to a change (k,), within their bounds.

        Each parameter is linear over each of its pieces; those of all effects that come nearest are taken.
        """
        target = self.projected(row)
        best, residual = [np.zeros(len(each.effect.parameters)) for each in signatures], row
        nearest = float(np.linalg.norm(target))
        choices = [chosen for chosen in product(*map(ways, signatures)) if any(chosen)]
        pieces = {id(piece): piece for chosen in choices for way in chosen for piece in way.values()}
        if not pieces:
            return Together(best, nearest, residual)
        basis, columns = np.linalg.qr(self.projected(np.array([piece.slope for piece in pieces.values()])).T)
        column = dict(zip(pieces, columns.T, strict=True))
        within = basis.T @ target
        beside = max(nearest**2 - float(within @ within), 0.0)
        for chosen in choices:
            own = [piece for way in chosen for piece in way.values()]
            bounds = ([piece.low for piece in own], [piece.high for piece in own])
            found = lsq_linear(np.column_stack([column[id(piece)] for piece in own]), within, bounds)
            distance = float(np.sqrt(2 * found.cost + beside))
            if distance < nearest:
                nearest, values = distance, iter(found.x)
                residual = row - np.column_stack([piece.slope for piece in own]) @ found.x
                for each, way in zip(best, chosen, strict=True):
                    each[:] = 0.0
                    each[list(way)] = [next(values) for _ in way]
        return Together(best, nearest, residual)
