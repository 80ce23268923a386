"""A surrogate of the twin near the mode: polynomials in the roots of the coefficients, with their error.

Kutta lift roughens the twin by some hundredths of a millimetre. What polynomials miss is counted as a further error
of the model, with its covariance (a nugget; Gramacy and Lee 2012), so that a sampler neither meets the roughness nor
mistakes it for knowledge. Whether a twin swims forward from rest is emulated too.
"""

from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import minimize
from scipy.special import log_expit

from swimmer.fluid import COEFFICIENT_BOUNDS

_RIDGE = 1e-8  # of the mean moment of the terms, so that these can be inverted
_DEGREES = (1, 2, 3, 4)
_SPARE = 2.5  # points over terms, at least: with 1.6 the long tail of Magnus lift on the real robot was cut short
_FARTHEST = 2.0  # leverage up to which it is trusted; a point that the polynomials must meet has 1
_PENALTY = 1e-4  # on half the squared weights: of 64 draws on the real robot none is on the wrong side; with 1e-2, 2


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


_POWERS = exponents(2)


class ForwardSwimming(NamedTuple):
    """How probable it is that a twin swims forward from rest.

    Attributes:
        weights: (t,) of the terms; none where every twin did.
    """

    weights: np.ndarray

    @classmethod
    def of(cls, coefficients: np.ndarray, forward: np.ndarray) -> "ForwardSwimming":
        """From coefficients (s, 5) of simulated twins and whether each swam forward (s,)."""
        if forward.all():
            return cls(np.zeros(0))
        columns = terms(coefficients, _POWERS) * np.where(forward, 1.0, -1.0)[:, None]

        def loss(weights: np.ndarray) -> tuple[float, np.ndarray]:
            odds = columns @ weights
            slope = -columns.T @ np.exp(log_expit(-odds)) + _PENALTY * weights
            return float(0.5 * _PENALTY * weights @ weights - log_expit(odds).sum()), slope

        return cls(minimize(loss, np.zeros(len(_POWERS)), jac=True, method="L-BFGS-B").x)

    def log_probability(self, coefficients: np.ndarray) -> np.ndarray:
        """(s,) for coefficients (s, 5)."""
        if not len(self.weights):
            return np.zeros(len(coefficients))
        return np.asarray(log_expit(terms(coefficients, _POWERS) @ self.weights))
