"""How wide intervals would be by the exact likelihood: the twin as it is, with the noise as it is."""

import emcee
import numpy as np
from scipy.linalg import block_diag

from benchmarks.posterior.truth import GLUED_SD_M
from fitting.model.noise import GaitNoise
from fitting.model.noise_part import NoisePart
from fitting.model.session_model import PlacesOff
from fitting.model.trial_model import TrialModel
from fitting.objective import COEFFICIENT_BOUNDS
from fitting.posterior import Posterior
from fitting.posterior.emulator import terms
from fitting.posterior.ensemble import MOVES, WALKERS
from synthetic import TrackingNoise

_STEPS = 900  # of which the last two thirds count
_GRID_PX = 0.5


def exact_widths(posterior: Posterior, noise: TrackingNoise, seed: int = 0) -> np.ndarray:
    """(5,) widths of the 90 % intervals that the true noise gives; nothing is estimated, and the twin is not in doubt.

    The stand-in for the twin is the posterior's; the covariance holds the noise and boxes as they are and all
    nuisances, but neither a discrepancy nor what the stand-in may miss. An ensemble draws, from the posterior's draws
    on.

    Args:
        posterior: of the session.
        noise: that the tracks were made with.
        seed: of the draws.
    """
    model, found = posterior.model, posterior.found
    box_sd_m = noise.placement_sd_px * float(np.mean([trial.trial.metres_per_px for trial in model.trials]))
    nuisances = found.disturbances.of(PlacesOff(box_sd_m, GLUED_SD_M)) - model.noise
    known = nuisances + block_diag(*[_true_noise(trial, noise) for trial in model.trials])
    emulator, root = found.likelihood.emulator, np.linalg.cholesky(known)
    measured = np.linalg.solve(root, model.measured)
    weights = np.linalg.solve(root, emulator.weights.T).T
    low, high = COEFFICIENT_BOUNDS

    def value(points: np.ndarray) -> np.ndarray:
        columns = terms(points, emulator.powers)
        inside = ((points >= low) & (points <= high)).all(axis=1) & emulator.covers(columns)
        return np.where(inside, -0.5 * ((columns @ weights - measured) ** 2).sum(axis=1), -np.inf)

    random = np.random.default_rng([seed, 7])
    apart = np.unique(posterior.coefficients, axis=0)  # a snooker move from a walker to its double is undefined
    start = random.choice(apart, WALKERS, replace=False)
    ensemble = emcee.EnsembleSampler(WALKERS, 5, value, vectorize=True, moves=MOVES)
    ensemble.random_state = np.random.RandomState(int(random.integers(2**31))).get_state()
    ensemble.run_mcmc(start, _STEPS, skip_initial_state_check=True)
    drawn = ensemble.get_chain(discard=_STEPS // 3, flat=True)
    return np.asarray(np.diff(np.quantile(drawn, [0.05, 0.95], axis=0), axis=0)[0])


def _true_noise(trial: TrialModel, noise: TrackingNoise) -> np.ndarray:
    """(k, k) covariance of a gait with the noise its tracks were made with; the rounding counts as white."""
    lasting, rounding = noise.sd_px**2, (_GRID_PX**2 / 12 if noise.half_pixel_grid else 0.0)
    white = rounding / (lasting + rounding)
    across = noise.across(trial.twin.robot.marker_positions_m(trial.trial.markers)[:, 0])
    sd_m = np.full(len(across), np.sqrt(lasting + rounding) * trial.trial.metres_per_px)
    part = NoisePart(1 - white, noise.correlation_s, False, across)
    return GaitNoise.of_parts(sd_m, [part], trial.gait.time_s).covariance(trial.gait)
