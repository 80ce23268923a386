"""The usual posterior, beside the true one: every frame an independent sample, nothing unknown but the phase.

Least squares over all samples with white noise of one unknown size. It takes errors that last for many new
measurements, and offers no other explanation of a misfit than the coefficients: it is too sure of where it lies.
"""

from collections.abc import Callable

import emcee
import numpy as np
from scipy.linalg import block_diag

from fitting.model.noise import GaitNoise
from fitting.model.trial_model import TrialModel
from fitting.objective import COEFFICIENT_BOUNDS
from fitting.posterior.approximate import Approximate
from fitting.posterior.emulator import terms
from fitting.posterior.posterior import Posterior

_WALKERS, _STEPS, _BURN_IN = 48, 1500, 500


def naive_posterior(posterior: Posterior, seed: int = 0) -> Approximate:
    """By the same stand-in for the twin, its own error left out.

    The size of the noise is integrated out under Jeffreys' prior, which leaves -N / 2 ln of the sum of squares.
    """
    models, emulator = posterior.model.trials, posterior.found.likelihood.emulator
    precision = block_diag(*[np.linalg.inv(_white(model)) for model in models])
    root = np.linalg.cholesky(precision)
    samples = sum(2 * int(model.gait.usable.sum()) for model in models)
    beside = sum(2 * float(model.gait.usable.sum(axis=0) @ model.noise.sd_m**2) for model in models)
    weights, measured = emulator.weights @ root, posterior.model.measured @ root
    low, high = COEFFICIENT_BOUNDS

    def value(points: np.ndarray) -> np.ndarray:
        columns = terms(points, emulator.powers)
        squares = beside + ((columns @ weights - measured) ** 2).sum(axis=1)
        inside = ((points >= low) & (points <= high)).all(axis=1) & emulator.covers(columns)
        return np.where(inside, -0.5 * samples * np.log(squares), -np.inf)

    draws = _sampled(value, posterior.coefficients, seed)
    low_end, middle, high_end = np.quantile(draws, [0.05, 0.5, 0.95], axis=0)
    return Approximate(middle, low_end, high_end)


def _white(model: TrialModel) -> np.ndarray:
    """(k, k) covariance of a gait whose samples have independent errors of 1 m."""
    frames, markers = model.gait.usable.shape
    return GaitNoise(np.ones(markers), 0.0, 1.0, np.eye(frames)).covariance(model.gait)


def _sampled(value: Callable[[np.ndarray], np.ndarray], draws: np.ndarray, seed: int) -> np.ndarray:
    """(d, 5) from where the posterior's own draws are likeliest."""
    starts = draws[np.argsort(-value(draws))[:_WALKERS]]
    spread = starts.std(axis=0) + 1e-6
    random = np.random.default_rng([seed, 2])
    starts = np.clip(starts + 0.1 * spread * random.standard_normal(starts.shape), *COEFFICIENT_BOUNDS)
    moves = [(emcee.moves.DEMove(), 0.8), (emcee.moves.DESnookerMove(), 0.2)]
    ensemble = emcee.EnsembleSampler(_WALKERS, 5, value, vectorize=True, moves=moves)
    ensemble.random_state = np.random.RandomState(seed).get_state()
    ensemble.run_mcmc(starts, _STEPS, skip_initial_state_check=True)
    return np.asarray(ensemble.get_chain(discard=_BURN_IN, flat=True))
