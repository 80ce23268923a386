"""Laplace's approximation: a normal distribution about the mode of the emulated posterior, with its curvature there."""

from collections.abc import Callable

import numpy as np
from scipy.optimize import minimize
from scipy.stats import norm

from fitting.objective import COEFFICIENT_BOUNDS
from fitting.posterior.approximate import Approximate
from fitting.posterior.ensemble import log_posterior
from fitting.posterior.posterior import Posterior

_STEP = 0.2  # of the curvature, in standard deviations of the posterior
_Z = float(norm.ppf(0.95))


def laplace(posterior: Posterior) -> Approximate:
    """Mode and curvature in the coefficients, the twin's discrepancies held at their median.

    Where the mode lies at a bound the curvature is that just inside; where it is not that of a maximum, there are no
    intervals. They end at the bounds.
    """
    log_density = log_posterior(posterior.found.likelihood)
    discrepancy = np.median(np.log(posterior.discrepancy), axis=0)
    draws, (low, high) = posterior.coefficients, COEFFICIENT_BOUNDS
    scale = draws.std(axis=0)

    def value(points: np.ndarray) -> np.ndarray:
        return log_density(np.column_stack([points, np.tile(discrepancy, (len(points), 1))]))

    mode = _mode(value, draws[np.argmax(value(draws))], scale)
    inside = np.clip(mode, low + 2 * _STEP * scale, high - 2 * _STEP * scale)
    half = _Z * _standard_deviations(-_curvature(value, inside, _STEP * scale))
    return Approximate(mode, np.clip(mode - half, low, high), np.clip(mode + half, low, high))


def _mode(value: Callable[[np.ndarray], np.ndarray], start: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """(5,) where the density is highest, from a start (5,)."""

    def misfit(z: np.ndarray) -> float:
        found = -value((start + scale * z)[None])[0]
        return float(found) if np.isfinite(found) else 1e12

    simplex = np.vstack([np.zeros(len(start)), 0.3 * np.eye(len(start))])
    options = {"initial_simplex": simplex, "xatol": 1e-3, "fatol": 1e-4, "maxfev": 4000}
    return start + scale * minimize(misfit, simplex[0], method="Nelder-Mead", options=options).x


def _curvature(value: Callable[[np.ndarray], np.ndarray], mode: np.ndarray, step: np.ndarray) -> np.ndarray:
    """(p, p) second derivatives by central differences; nan where they reach beyond the prior."""
    p = len(mode)
    signs = np.array([(1, 1), (1, -1), (-1, 1), (-1, -1)])
    units = np.eye(p)
    corners = np.array(
        [mode + step * (a * units[i] + b * units[j]) for i in range(p) for j in range(p) for a, b in signs]
    )
    with np.errstate(invalid="ignore"):
        cross = value(corners).reshape(p, p, 4) @ np.array([1, -1, -1, 1])
    return cross / (4 * np.outer(step, step))


def _standard_deviations(information: np.ndarray) -> np.ndarray:
    """(p,) roots of the diagonal of the inverse; nan where it is no covariance."""
    if not np.isfinite(information).all() or np.linalg.eigvalsh(information)[0] <= 0:
        return np.full(len(information), np.nan)
    return np.sqrt(np.diag(np.linalg.inv(information)))
