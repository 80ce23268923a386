"""A surrogate of the twin near the mode: polynomials in the roots of the coefficients, with their error.

Kutta lift roughens the twin by some hundredths of a millimetre. What polynomials miss is counted as a further error
of the model, with its covariance (a nugget; Gramacy and Lee 2012), so that a sampler neither meets the roughness nor
mistakes it for knowledge.
"""

from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np
from scipy.linalg import solve_triangular

from fitting.objective import COEFFICIENT_BOUNDS

_RIDGE = 1e-8  # of the mean moment of the terms, so that these can be inverted
_DEGREES = (1, 2, 3, 4)
_SPARE = 2.5  # points over terms, at least: with 1.6 the long tail of Magnus lift on the real robot was cut short
_FARTHEST = 2.0  # leverage up to which it is trusted; a point that the polynomials must meet has 1


@dataclass(frozen=True, eq=False)
class Emulator:
    """Features as polynomials of the coefficients.

    Attributes:
        powers: (t, 5) exponents of the terms.
        weights: (t, k) of the terms in each of k numbers.
        error: (k, k) covariance of what the polynomials miss, judged on points left out one at a time.
        scatter: (t, t) root of the inverse moments of the terms over the points it was made from.
    """

    powers: np.ndarray
    weights: np.ndarray
    error: np.ndarray
    scatter: np.ndarray

    def covers(self, columns: np.ndarray) -> np.ndarray:
        """(s,) whether points with these terms (s, t) lie among those it was made from, by their leverage."""
        return ((columns @ self.scatter) ** 2).sum(axis=1) <= _FARTHEST

    def __call__(self, coefficients: np.ndarray) -> np.ndarray:
        """(s, k) for coefficients (s, 5)."""
        return terms(coefficients, self.powers) @ self.weights


def fit_emulator(coefficients: np.ndarray, features: np.ndarray) -> Emulator:
    """The polynomials of the highest degree for which the points suffice.

    Args:
        coefficients: (s, 5).
        features: (s, k) at them.
    """
    degrees = [degree for degree in _DEGREES if len(exponents(degree)) * _SPARE <= len(coefficients)]
    powers = exponents(max(degrees, default=_DEGREES[0]))
    columns = terms(coefficients, powers)
    ridge = _RIDGE * np.trace(columns.T @ columns) / columns.shape[1]
    scatter = _inverse_root(columns.T @ columns + ridge * np.eye(columns.shape[1]))
    weights = scatter @ (scatter.T @ (columns.T @ features))
    leverage = ((columns @ scatter) ** 2).sum(axis=1, keepdims=True)
    missed = (features - columns @ weights) / np.maximum(1 - leverage, 0.05)
    return Emulator(powers, weights, missed.T @ missed / len(missed), scatter)


def exponents(degree: int) -> np.ndarray:
    """(t, 5) of all products of up to `degree` coefficients."""
    rows = [
        np.bincount(np.array(chosen, int), minlength=5)
        for d in range(degree + 1)
        for chosen in combinations_with_replacement(range(5), d)
    ]
    return np.array(rows)


def terms(coefficients: np.ndarray, powers: np.ndarray) -> np.ndarray:
    """(s, t) products of Legendre polynomials in the roots of coefficients (s, 5), scaled to -1 to 1."""
    x = 2 * np.sqrt(np.clip(coefficients, *COEFFICIENT_BOUNDS) / COEFFICIENT_BOUNDS[1]) - 1
    table = np.polynomial.legendre.legvander(x, int(powers.max(initial=0)))  # (s, 5, d + 1)
    return np.prod(np.take_along_axis(table[:, None], powers[None, ..., None], axis=-1)[..., 0], axis=-1)


def _inverse_root(moments: np.ndarray) -> np.ndarray:
    """(t, t) whose product with its transpose is the inverse of moments (t, t), which may be close to singular."""
    return solve_triangular(np.linalg.cholesky(moments), np.eye(len(moments)), lower=True).T
