"""Sampling of the posterior by an ensemble, with its diagnostics, and the surrogate of the twin that is sampled.

`sample` runs until the draws suffice. `fit_surrogate` makes what it samples: the first simulations are draws of the
normal approximation about the mode, wider by a factor. Then the twin is simulated at draws from the posterior by the
emulator so far, half of them moved outward, and the emulator is made anew, until it predicts fresh draws. What it
misses counts as an error of the model, so that early rounds look widely.
"""

import warnings
from dataclasses import dataclass
from typing import NamedTuple

import emcee
import numpy as np
import xarray

from fitting.coefficient_fit import NAMES
from fitting.mode import Mode
from fitting.posterior.emulator import SPEEDS, WAVE, ForwardSwimming, Likelihood, fit_emulator, size_of
from fitting.progress import Progress
from swimcal.flags import Flag
from swimcal.mjcf import COEFFICIENT_BOUNDS

with warnings.catch_warnings():  # ArviZ announces its next release at the first import of every day
    warnings.filterwarnings("ignore", message=r"\s*ArviZ is undergoing", category=FutureWarning)
    import arviz

# The ensemble
VARIABLES = (*NAMES, "ln_wave_discrepancy", "ln_speed_discrepancy")
WALKERS = 64  # walkers of the ensemble
R_HAT = 1.01  # largest R-hat of a coefficient that has converged
_MOVES = ((emcee.moves.DEMove(), 0.6), (emcee.moves.DESnookerMove(), 0.2), (emcee.moves.KDEMove(), 0.2))
_CHUNK = 1000  # steps at once: some 10 autocorrelation times at least
_LONGEST = 40_000  # steps at most, a few minutes
_BURN_IN = 0.2  # share of the steps, though walkers begin within the posterior
_APART = 1e-6  # relative difference of copied walkers: a snooker move from one to its double is undefined

# The surrogate
_FIRST = 144  # simulations of the first round: enough for cubics (56 terms)
_AT_ONCE = 24  # simulations between two reports of progress
_FIRST_SHARE = 0.65  # share of the time that the first round takes
_ROUND = 64  # simulations of each further round
_ROUNDS = 10  # largest number of rounds
_STEPS = 500  # steps of the walkers in each round
_ASKED = 3  # one in so many of the first points is simulated from rest, unless a twin swims backward
_OUTWARD = 1.7  # factor by which draws are moved from their middle, beyond where walkers will go
_GOOD_ENOUGH = 1.0  # sd of emulated minus simulated ln likelihood below which no round follows
_SURE = 0.4  # the same, below which the first round may be the last
_AMONG = 0.5  # leverage of draws that lie well among the points: exceeded by 1 of 20 at most
_STABLE_SD = 0.4  # largest move of medians and interval ends between rounds, in standard deviations


# The ensemble.


@dataclass(frozen=True, eq=False)
class Draws:
    """Draws of an ensemble.

    Attributes:
        chains: (w, d, 7) walkers, draws, coefficients and ln sizes of the discrepancies of wave and speed; the burn-in
            left out, thinned.
        ess_bulk, r_hat: (7,) effective draws and rank-normalised split R-hat (Vehtari et al. 2021), a walker a chain.
        acceptance: share of moves accepted.
        autocorrelation: autocorrelation time in steps, the longest of the seven.
        steps: steps of each walker.
        flags: that there are too few, or that walkers disagree.
    """

    chains: np.ndarray
    ess_bulk: np.ndarray
    r_hat: np.ndarray
    acceptance: float
    autocorrelation: float
    steps: int
    flags: tuple[Flag, ...]

    @property
    def flat(self) -> np.ndarray:
        """All draws in one array, (w d, 7)."""
        return self.chains.reshape(-1, self.chains.shape[-1])


def log_posterior(likelihood: Likelihood, prior: ForwardSwimming, points: np.ndarray) -> np.ndarray:
    """Return the ln density (s,) of points (s, 7).

    The prior is uniform in the coefficients of twins that swim forward from rest, normal in the ln sizes of the
    discrepancies.

    Args:
        likelihood: the likelihood.
        prior: probability of swimming forward from rest.
        points: (s, 7) coefficients and ln sizes.
    """
    low, high = COEFFICIENT_BOUNDS
    coefficients, ln_sizes = points[:, :5], points[:, 5:]
    inside = ((coefficients >= low) & (coefficients <= high)).all(axis=1)
    result = np.full(len(points), -np.inf)
    result[inside] = likelihood(coefficients[inside], np.exp(ln_sizes[inside]))
    result += prior.log_probability(coefficients)
    return result - 0.5 * (((ln_sizes - likelihood.ln_mean) / likelihood.ln_sd) ** 2).sum(axis=1)


def sampler(likelihood: Likelihood, prior: ForwardSwimming, random: np.random.Generator) -> emcee.EnsembleSampler:
    """Return an ensemble (Foreman-Mackey et al. 2013) that moves by differential evolution (ter Braak and Vrugt 2008).

    Args:
        likelihood: the likelihood.
        prior: probability of swimming forward from rest.
        random: generator that seeds it.
    """
    ensemble = emcee.EnsembleSampler(
        WALKERS, len(VARIABLES), lambda points: log_posterior(likelihood, prior, points), vectorize=True, moves=_MOVES
    )
    ensemble.random_state = np.random.RandomState(int(random.integers(2**31))).get_state()
    return ensemble


def placed(
    walkers: np.ndarray, likelihood: Likelihood, prior: ForwardSwimming, random: np.random.Generator
) -> np.ndarray:
    """Return the walkers (w, 7), those where nothing is known moved next to others.

    Args:
        walkers: (w, 7).
        likelihood: the likelihood.
        prior: probability of swimming forward from rest.
        random: the generator.
    """
    known = np.isfinite(log_posterior(likelihood, prior, walkers))
    others = walkers[random.choice(np.flatnonzero(known), len(walkers))]
    others = others * (1 + _APART * random.standard_normal(others.shape))
    return np.where(known[:, None], walkers, others)


def sample(
    likelihood: Likelihood,
    prior: ForwardSwimming,
    walkers: np.ndarray,
    effective: int = 400,
    seed: int = 0,
    tell: Progress = lambda _message, _share: None,
) -> Draws:
    """Sample until every coefficient has so many effective draws and an R-hat of 1.01 at most.

    Args:
        likelihood: the likelihood.
        prior: probability of swimming forward from rest.
        walkers: (w, 7) to start from.
        effective: number of effective draws.
        seed: seed of the draws.
        tell: takes messages with the share of the work that is done.
    """
    random = np.random.default_rng([seed, 2])
    ensemble, state = sampler(likelihood, prior, random), placed(walkers, likelihood, prior, random)
    while True:
        state = ensemble.run_mcmc(state, _CHUNK, skip_initial_state_check=True)
        draws = _judge(ensemble, effective)
        message = (
            f"sampling: {draws.ess_bulk[:5].min():.0f} effective draws, R-hat {draws.r_hat[:5].max():.3f}, acceptance "
            f"{draws.acceptance:.2f}, autocorrelation {draws.autocorrelation:.0f} steps"
        )
        tell(message, min(float(draws.ess_bulk[:5].min()) / effective, 0.99))
        if not draws.flags or ensemble.iteration >= _LONGEST:
            return draws


def _judge(ensemble: emcee.EnsembleSampler, effective: int) -> Draws:
    steps = ensemble.iteration
    longest = float(np.max(ensemble.get_autocorr_time(tol=0, discard=int(_BURN_IN * steps))))
    thin = max(int(longest / 4), 1)
    chains = ensemble.get_chain(discard=int(_BURN_IN * steps), thin=thin).transpose(1, 0, 2)  # (w, d, 7)
    data = as_dataset(chains)
    ess, r_hat = (np.array([float(each[name]) for name in VARIABLES]) for each in (arviz.ess(data), arviz.rhat(data)))
    enough = bool((ess[:5] >= effective).all() and (r_hat[:5] <= R_HAT).all())
    message = (
        f"sampled too little: {ess[:5].min():.0f} effective draws (wanted {effective}) and R-hat {r_hat[:5].max():.3f} "
        f"(wanted {R_HAT:g} at most) after the longest run; do not report these intervals"
    )
    flags = () if enough else (Flag("not_converged", message=message),)
    return Draws(chains, ess, r_hat, float(ensemble.acceptance_fraction.mean()), longest, steps, flags)


def as_dataset(chains: np.ndarray) -> xarray.Dataset:
    """Return chains (w, d, 7) as ArviZ reads them: a walker is a chain."""
    places = {"chain": np.arange(chains.shape[0]), "draw": np.arange(chains.shape[1])}
    return xarray.Dataset({name: (("chain", "draw"), chains[..., i]) for i, name in enumerate(VARIABLES)}, places)


# The surrogate that it samples.


class Surrogate(NamedTuple):
    """Surrogate of the twin in the posterior.

    Attributes:
        likelihood: likelihood with the emulator.
        prior: probability of swimming forward from rest.
        walkers: (w, 7) draws to start from.
        simulations: simulations of each trial.
        error: standard deviation of emulated minus simulated ln likelihood at fresh draws.
        settled: whether intervals were stable in the last round, or the emulator as good as exact and no draw at the
            edge of what was simulated; and it missed fresh draws by no more than the error that the likelihood counts.
    """

    likelihood: Likelihood
    prior: ForwardSwimming
    walkers: np.ndarray
    simulations: int
    error: float
    settled: bool


def fit_surrogate(mode: Mode, seed: int = 0, tell: Progress = lambda _message, _share: None) -> Surrogate:
    """Simulate the trials of a mode until an emulator holds where the posterior lies.

    Args:
        mode: the fit.
        seed: seed of the draws.
        tell: takes messages with the share of the work that is done.
    """
    random = np.random.default_rng([seed, 1])
    points, parts = _draw_about(mode, _FIRST, _OUTWARD, random), []
    for first in range(0, len(points), _AT_ONCE):
        tell("simulating about the fit", _FIRST_SHARE * first / len(points))
        parts.append(_simulate(mode, points[first : first + _AT_ONCE]))
    good, features = map(np.concatenate, zip(*parts, strict=True))
    points, features = points[good], features[good]
    forward = _swim_forward(mode, points, _outermost(mode, points, len(points) // _ASKED))
    walkers, before, error, settled = _begin(mode, random), np.full((3, 5), np.inf), np.inf, False
    for round_ in range(_ROUNDS):
        share = _FIRST_SHARE + (1 - _FIRST_SHARE) * (1 - 0.5**round_)  # two rounds mostly do
        tell(f"emulating the twin, round {round_ + 1}", share)
        likelihood = Likelihood.of(mode, fit_emulator(points, features))
        prior = ForwardSwimming.of(points, forward)
        ensemble = sampler(likelihood, prior, random)
        ensemble.run_mcmc(placed(walkers, likelihood, prior, random), _STEPS, skip_initial_state_check=True)
        walkers, drawn = ensemble.get_last_sample().coords, ensemble.get_chain(discard=_STEPS // 2, flat=True)
        places, spread = np.quantile(drawn[:, :5], [0.05, 0.5, 0.95], axis=0), drawn[:, :5].std(axis=0)
        fresh = drawn[random.choice(len(drawn), _ROUND, replace=False)]
        fresh[_ROUND // 2 :, :5] = _reflect(places[1] + _OUTWARD * (fresh[_ROUND // 2 :, :5] - places[1]))
        good, more = _simulate(mode, fresh[:, :5])
        inner = good & (np.arange(_ROUND) < _ROUND // 2)
        error, held = _measure_error(likelihood, fresh[inner], more[inner])
        points, features = np.vstack([points, fresh[good, :5]]), np.vstack([features, more[good]])
        outer = np.flatnonzero((np.arange(_ROUND) >= _ROUND // 2)[good] | ~forward.all())
        forward = np.append(forward, _swim_forward(mode, fresh[good, :5], outer))
        sure = error < _SURE and float(np.quantile(likelihood.emulator.leverage(drawn[:, :5]), 0.95)) < _AMONG
        settled = held and (sure or bool((np.abs(places - before) < _STABLE_SD * spread).all()))
        before = places
        if settled and error < _GOOD_ENOUGH:
            break
    likelihood = Likelihood.of(mode, fit_emulator(points, features))
    return Surrogate(likelihood, ForwardSwimming.of(points, forward), walkers, len(points), error, settled)


def _simulate(mode: Mode, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Simulate features (s, k) at points (s, 5), and tell where the twin did not diverge (s,)."""
    features = mode.model.simulated(points)
    return np.isfinite(features).all(axis=1), features


def _swim_forward(mode: Mode, points: np.ndarray, asked: np.ndarray) -> np.ndarray:
    """Tell which twins of points (s, 5) swim forward from rest, (s,): all, if all do of those asked, (a,) indices."""
    forward = np.ones(len(points), bool)
    forward[asked] = mode.model.swim_forward(points[asked])
    if not forward.all():
        others = np.setdiff1d(np.arange(len(points)), asked)
        forward[others] = mode.model.swim_forward(points[others])
    return forward


def _outermost(mode: Mode, points: np.ndarray, count: int) -> np.ndarray:
    """Return the indices (count,) of the points (s, 5) that are farthest from a mode, in its covariance."""
    away = points - mode.coefficients
    distance = (away @ np.linalg.inv(mode.coefficient_covariance) * away).sum(axis=1)
    return np.argsort(-distance, kind="stable")[:count]


def _measure_error(likelihood: Likelihood, drawn: np.ndarray, features: np.ndarray) -> tuple[float, bool]:
    """Return the standard deviation of emulated minus simulated ln likelihood at draws (s, 7) with features (s, k).

    Also tell whether features are missed by no more than the emulator's error.
    """
    points, sizes = drawn[:, :5], np.exp(drawn[:, 5:])
    off = likelihood.of_features(features, sizes) - likelihood(points, sizes)
    missed = likelihood.whitened(features - likelihood.emulator(points))
    counted = np.trace(likelihood.whitened(likelihood.whitened(likelihood.emulator.error).T))
    return float(off.std()), bool((missed**2).sum(axis=1).mean() <= counted)


def _draw_about(mode: Mode, count: int, wider: float, random: np.random.Generator) -> np.ndarray:
    """Draw points (c, 5) of the normal approximation about a mode, wider by a factor, reflected at the bounds."""
    root = np.linalg.cholesky(mode.coefficient_covariance)
    return _reflect(mode.coefficients + wider * random.standard_normal((count, 5)) @ root.T)


def _begin(mode: Mode, random: np.random.Generator) -> np.ndarray:
    """Draw the first walkers (w, 7) about the mode."""
    sizes = np.log([size_of(mode, names) for names in (WAVE, SPEEDS)]) + 0.1 * random.standard_normal((WALKERS, 2))
    return np.column_stack([_draw_about(mode, WALKERS, 1.0, random), sizes])


def _reflect(points: np.ndarray) -> np.ndarray:
    low, high = COEFFICIENT_BOUNDS
    points = low + np.abs(points - low)
    return np.clip(high - np.abs(high - points), low, high)
