"""What the twin's finite time step does to gaits, so that the posterior is of a twin whose step vanishes.

The integrator is of first order: with steps of 4.5 ms gaits lie several standard errors from those of fine steps, which
moves Kutta lift by more than its interval. Twice the change from whole to half steps is what is missing (Richardson
1911); it is linear in the coefficients as far as a posterior reaches.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fitting.posterior.emulator import exponents, terms
from swimmer import Twin

_TERMS = exponents(1)
_HALVED = 16  # points that are simulated with half the step too
_FEWEST = 12


@dataclass(frozen=True, eq=False)
class StepShift:
    """By how much gaits move when the time step vanishes.

    Attributes:
        weights: (6, k) of the linear terms.
        error: (k, k) covariance of what they leave, judged on points left out one at a time.
    """

    weights: np.ndarray
    error: np.ndarray

    @classmethod
    def none(cls, length: int) -> "StepShift":
        """For gaits of length k, as long as nothing is known."""
        return cls(np.zeros((len(_TERMS), length)), np.zeros((length, length)))

    @classmethod
    def fitted(cls, coefficients: np.ndarray, whole: np.ndarray, half: np.ndarray) -> "StepShift":
        """From gaits (s, k) at coefficients (s, 5) with whole and with half steps, each simulated or emulated."""
        columns, shift = terms(coefficients, _TERMS), 2 * (half - whole)
        ridge = 1e-6 * np.trace(columns.T @ columns) / len(_TERMS) * np.eye(len(_TERMS))
        inverse = np.linalg.inv(columns.T @ columns + ridge)
        weights = inverse @ (columns.T @ shift)
        leverage = np.einsum("st,tu,su->s", columns, inverse, columns)[:, None]
        left = (shift - columns @ weights) / np.maximum(1 - leverage, 0.1)
        return cls(weights, left.T @ left / len(left))

    def __call__(self, coefficients: np.ndarray) -> np.ndarray:
        """(s, k) for coefficients (s, 5)."""
        return terms(coefficients, _TERMS) @ self.weights


def at_vanishing_step(
    simulate: Callable[[Twin, np.ndarray], np.ndarray], twin: Twin, coefficients: np.ndarray
) -> np.ndarray:
    """(s, k) what a twin would do at coefficients (s, 5) if its time step vanished; nan where it diverged.

    Args:
        simulate: (s, k) what a twin does at coefficients (s, 5).
        twin: as it is; the first of the coefficients are simulated with half its step as well.
        coefficients: (s, 5).
    """
    whole, first = simulate(twin, coefficients), coefficients[:_HALVED]
    half = simulate(twin.at_step(twin.scene.timestep_s / 2), first)
    good = np.isfinite(whole[: len(first)]).all(axis=1) & np.isfinite(half).all(axis=1)
    if good.sum() < _FEWEST:
        return whole
    return whole + StepShift.fitted(first[good], whole[: len(first)][good], half[good])(coefficients)
