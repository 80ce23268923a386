"""The posterior's density and the ensemble of walkers that draws from it."""

from collections.abc import Callable

import emcee
import numpy as np

from fitting.objective import COEFFICIENT_BOUNDS
from fitting.posterior.likelihood import LEAST_DISCREPANCY, MOST_SPEED, MOST_WAVE, Likelihood

WALKERS = 64
DIMENSIONS = 7  # five coefficients and the logarithms of the discrepancies of wave and speed
LOG_MOST = np.log([MOST_WAVE, MOST_SPEED])
MOVES = ((emcee.moves.DEMove(), 0.6), (emcee.moves.DESnookerMove(), 0.2), (emcee.moves.KDEMove(), 0.2))


def log_posterior(
    likelihood: Likelihood, least_discrepancy: float = LEAST_DISCREPANCY
) -> Callable[[np.ndarray], np.ndarray]:
    """ln posterior of points (s, 7): uniform in the coefficients and in the logarithms of the discrepancies."""
    low, high = COEFFICIENT_BOUNDS

    def value(points: np.ndarray) -> np.ndarray:
        coefficients, log_discrepancy = points[:, :5], points[:, 5:]
        inside = ((coefficients >= low) & (coefficients <= high)).all(axis=1)
        inside &= ((log_discrepancy >= np.log(least_discrepancy)) & (log_discrepancy <= LOG_MOST)).all(axis=1)
        result = np.full(len(points), -np.inf)
        result[inside] = likelihood(coefficients[inside], np.exp(log_discrepancy[inside]))
        return result

    return value


def sampler(
    likelihood: Likelihood,
    backend: emcee.backends.Backend | None = None,
    least_discrepancy: float = LEAST_DISCREPANCY,
) -> emcee.EnsembleSampler:
    """An ensemble (Foreman-Mackey et al. 2013) that moves by differential evolution (ter Braak and Vrugt 2008)."""
    return emcee.EnsembleSampler(
        WALKERS,
        DIMENSIONS,
        log_posterior(likelihood, least_discrepancy),
        vectorize=True,
        moves=MOVES,
        backend=backend,
    )
