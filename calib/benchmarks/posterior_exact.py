"""How wide intervals would be by the exact likelihood: the twin at the truth, with the noise as it is."""

import numpy as np
from scipy.linalg import block_diag

from fitting.objective import COEFFICIENT_BOUNDS
from fitting.posterior.noise import GaitNoise
from fitting.posterior.session_model import SessionModel
from fitting.posterior.trial_model import TrialModel
from synthetic import TrackingNoise

_STEP = 0.1  # of a coefficient, each way
_DRAWS, _FEWEST = 200_000, 1000
_GRID_PX = 0.5


def exact_widths(model: SessionModel, truth: np.ndarray, noise: TrackingNoise, seed: int = 0) -> np.ndarray:
    """(5,) widths of 90 % intervals of a Gaussian at the truth, cut off by the box; nan where little is inside.

    Its precision is J' C^-1 J with the slopes J of the simulated gaits and the covariance C of the true noise and of
    all nuisances, boxes as far off as they are: no emulator, no discrepancy, nothing estimated.

    Args:
        model: the session.
        truth: (5,) coefficients.
        noise: that the tracks were made with.
        seed: of the draws that find the quantiles.
    """
    slopes = _slopes(model, truth)
    box_sd_m = noise.placement_sd_px * float(np.mean([trial.trial.metres_per_px for trial in model.trials]))
    nuisances = model.disturbances(truth).of(box_sd_m) - model.noise
    known = nuisances + block_diag(*[_true_noise(trial, noise) for trial in model.trials])
    root = np.linalg.cholesky(np.linalg.inv(slopes.T @ np.linalg.solve(known, slopes)))
    drawn = truth + np.random.default_rng([seed, 7]).standard_normal((_DRAWS, 5)) @ root.T
    low, high = COEFFICIENT_BOUNDS
    inside = drawn[((drawn >= low) & (drawn <= high)).all(axis=1)]
    if len(inside) < _FEWEST:
        return np.full(5, np.nan)
    return np.asarray(np.diff(np.quantile(inside, [0.05, 0.95], axis=0), axis=0)[0])


def _slopes(model: SessionModel, truth: np.ndarray) -> np.ndarray:
    """(k, 5) of the row of gaits, by central differences; one-sided at the ends of the box."""
    points = np.clip(
        np.repeat(truth[None], 10, axis=0) + _STEP * np.vstack([np.eye(5), -np.eye(5)]), *COEFFICIENT_BOUNDS
    )
    gaits = model.simulated(points)
    return ((gaits[:5] - gaits[5:]) / np.diag(points[:5] - points[5:])[:, None]).T


def _true_noise(trial: TrialModel, noise: TrackingNoise) -> np.ndarray:
    """(k, k) covariance of a gait with the noise its tracks were made with; the rounding counts as white."""
    lasting, rounding = noise.sd_px**2, (_GRID_PX**2 / 12 if noise.half_pixel_grid else 0.0)
    white = rounding / (lasting + rounding)
    lag_s = np.abs(trial.gait.time_s[:, None] - trial.gait.time_s)
    correlation = (1 - white) * np.exp(-lag_s / noise.correlation_s) + white * np.eye(len(lag_s))
    sd_m = np.full(trial.gait.usable.shape[1], np.sqrt(lasting + rounding) * trial.trial.metres_per_px)
    return GaitNoise(sd_m, noise.correlation_s, white, correlation).covariance(trial.gait)
