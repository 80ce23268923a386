"""A surrogate of the twin where the posterior lies: simulations about the mode, and where draws then fall.

The first simulations are draws of the normal approximation about the mode, wider by a factor. Then the twin is
simulated at draws from the posterior by the emulator so far, half of them moved outward, and the emulator is made anew,
until it predicts fresh draws. What it misses counts as an error of the model, so that early rounds look widely.
"""

from typing import NamedTuple

import numpy as np

from fitting.model import Mode
from fitting.model.mode import Progress
from fitting.posterior.emulator import ForwardSwimming, fit_emulator
from fitting.posterior.likelihood import SPEEDS, WAVE, Likelihood, size_of
from fitting.posterior.sampling import WALKERS, placed, sampler
from swimmer.fluid import COEFFICIENT_BOUNDS

_FIRST, _ROUND = 144, 64  # simulations: enough for cubics (56 terms) from the first round on; of each further round
_ROUNDS = 10  # most
_STEPS = 500  # of the walkers in each round
_OUTWARD = 1.7  # by which draws are moved from their middle: beyond where walkers will go
_GOOD_ENOUGH = 1.0  # standard deviation of emulated minus simulated ln likelihood, below which no round follows
_STABLE_SD = 0.4  # by which medians and ends of intervals may still move from round to round, in standard deviations


class Surrogate(NamedTuple):
    """What stands for the twin in the posterior.

    Attributes:
        likelihood: by the emulator.
        prior: that it swims forward from rest.
        walkers: (w, 7) draws to start from.
        simulations: of each trial.
        error: standard deviation of emulated minus simulated ln likelihood at fresh draws.
        settled: whether intervals stood still in the last round, and the emulator missed fresh draws by no more than
            the error that the likelihood counts.
    """

    likelihood: Likelihood
    prior: ForwardSwimming
    walkers: np.ndarray
    simulations: int
    error: float
    settled: bool


def fit_surrogate(mode: Mode, seed: int = 0, tell: Progress = lambda _message, _share: None) -> Surrogate:
    """Simulates the trials of a mode until an emulator holds where the posterior lies."""
    random = np.random.default_rng([seed, 1])
    points = _about(mode, _FIRST, _OUTWARD, random)
    good, features = _simulated(mode, points)
    points, features = points[good], features[good]
    forward = mode.model.swim_forward(points)
    walkers, before, error, settled = _begin(mode, random), np.full((3, 5), np.inf), np.inf, False
    for round_ in range(_ROUNDS):
        tell(f"emulating the twin, round {round_ + 1}", round_ / _ROUNDS)
        likelihood = Likelihood.of(mode, fit_emulator(points, features))
        prior = ForwardSwimming.of(points, forward)
        ensemble = sampler(likelihood, prior, random)
        ensemble.run_mcmc(placed(walkers, likelihood, prior, random), _STEPS, skip_initial_state_check=True)
        walkers, drawn = ensemble.get_last_sample().coords, ensemble.get_chain(discard=_STEPS // 2, flat=True)
        places, spread = np.quantile(drawn[:, :5], [0.05, 0.5, 0.95], axis=0), drawn[:, :5].std(axis=0)
        fresh = drawn[random.choice(len(drawn), _ROUND, replace=False)]
        fresh[_ROUND // 2 :, :5] = _reflected(places[1] + _OUTWARD * (fresh[_ROUND // 2 :, :5] - places[1]))
        good, more = _simulated(mode, fresh[:, :5])
        inner = good & (np.arange(_ROUND) < _ROUND // 2)
        error, held = _missed(likelihood, fresh[inner], more[inner])
        points, features = np.vstack([points, fresh[good, :5]]), np.vstack([features, more[good]])
        forward = np.append(forward, mode.model.swim_forward(fresh[good, :5]))
        settled = held and bool((np.abs(places - before) < _STABLE_SD * spread).all())
        before = places
        if settled and error < _GOOD_ENOUGH:
            break
    likelihood = Likelihood.of(mode, fit_emulator(points, features))
    return Surrogate(likelihood, ForwardSwimming.of(points, forward), walkers, len(points), error, settled)


def _simulated(mode: Mode, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(s,) whether the twin stood at points (s, 5), and (s, k) features there."""
    features = mode.model.simulated(points)
    return np.isfinite(features).all(axis=1), features


def _missed(likelihood: Likelihood, drawn: np.ndarray, features: np.ndarray) -> tuple[float, bool]:
    """Standard deviation of emulated minus simulated ln likelihood at draws (s, 7) with features (s, k).

    And whether features are missed by no more than the emulator's error has it.
    """
    points, sizes = drawn[:, :5], np.exp(drawn[:, 5:])
    off = likelihood.of_features(features, sizes) - likelihood(points, sizes)
    missed = likelihood.whitened(features - likelihood.emulator(points))
    counted = np.trace(likelihood.whitened(likelihood.whitened(likelihood.emulator.error).T))
    return float(off.std()), bool((missed**2).sum(axis=1).mean() <= counted)


def _about(mode: Mode, count: int, wider: float, random: np.random.Generator) -> np.ndarray:
    """(c, 5) draws of the normal approximation about a mode, wider by a factor, reflected at the bounds."""
    root = np.linalg.cholesky(mode.coefficient_covariance)
    return _reflected(mode.coefficients + wider * random.standard_normal((count, 5)) @ root.T)


def _begin(mode: Mode, random: np.random.Generator) -> np.ndarray:
    """(w, 7) about the mode."""
    sizes = np.log([size_of(mode, names) for names in (WAVE, SPEEDS)]) + 0.1 * random.standard_normal((WALKERS, 2))
    return np.column_stack([_about(mode, WALKERS, 1.0, random), sizes])


def _reflected(points: np.ndarray) -> np.ndarray:
    low, high = COEFFICIENT_BOUNDS
    points = low + np.abs(points - low)
    return np.clip(high - np.abs(high - points), low, high)
