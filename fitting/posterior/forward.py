"""The part of the prior that says the robot swims forward from rest, as a smooth function of the coefficients.

Whether a twin does is known where it was simulated. Between such points the odds are a logistic regression on
quadratic terms, with a penalty, so that it stays finite where the two kinds are cleanly apart.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize
from scipy.special import log_expit

from fitting.posterior.emulator import exponents, terms

_POWERS = exponents(2)
_PENALTY = 1e-4  # on half the squared weights: of 64 draws on the real robot none is on the wrong side; with 1e-2, 2


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
