"""A session as one row.

A row holds the features of all swims, then how far each beats from its command, and then how free decays ring.
"""

import numpy as np
from scipy.linalg import block_diag

from fitting.model.session_model import SessionModel
from fitting.objective import COEFFICIENT_BOUNDS
from fitting.trial import MeasuredTrial

PRIOR_SD = np.full(5, (COEFFICIENT_BOUNDS[1] - COEFFICIENT_BOUNDS[0]) / np.sqrt(12.0))
TOLD_TO = 0.002  # relative standard deviation of a measured frequency about the commanded one
_ALIKE = 0.8  # correlation of that of the tail with that of the motor's log: both do what the motor does
_LEAST = 0.01  # of a coefficient about which slopes are taken: nearer to 0 steps are lost in the twin's roughness
_STEP = 0.02  # of the root of a coefficient, either way
LONG = 10.0
"""Whitened length of a step after which slopes are simulated anew."""


def residual_row(model: SessionModel, at: np.ndarray) -> np.ndarray:
    """(k + b,) what the twin at coefficients (5,) leaves of the features, and of the numbers beside them.

    Of frequencies what they are off their commands, Hz: first those of all tails, as filmed, then those of the motors
    that were logged; and then of free decays.
    """
    residual = model.measured - model.simulated(at[None])[0]
    trials = [each.trial for each in model.trials]
    hertz = [0.0 if trial.commanded_hz is None else trial.frequency.hz - trial.commanded_hz for trial in trials]
    logged = [_off_command(trials[number]) for number in model.logged]
    return np.concatenate([residual, hertz, logged, model.ring_residuals])


def _off_command(trial: MeasuredTrial) -> float:
    """Of a logged motor, Hz."""
    assert trial.logged_hz is not None
    assert trial.commanded_hz is not None
    return trial.logged_hz - trial.commanded_hz


def row_slopes(model: SessionModel, at: np.ndarray) -> np.ndarray:
    """(k + b, 5) of the row with the coefficients, on which only features depend; even steps in their roots."""
    roots = np.sqrt(np.maximum(at, _LEAST)) + _STEP * np.vstack([np.eye(5), -np.eye(5)])
    points = np.clip(roots, 0.0, np.sqrt(COEFFICIENT_BOUNDS[1])) ** 2
    features = model.simulated(points)
    slopes = (features[:5] - features[5:]) / np.diag(points[:5] - points[5:])[:, None]
    return np.vstack([slopes.T, np.zeros((model.beside, 5))])


def row_covariance(model: SessionModel, features: np.ndarray, robot: np.ndarray | None = None) -> np.ndarray:
    """(k + b, k + b) from that of the features (k, k): frequencies are as far off their commands as motors are.

    Args:
        model: the swims.
        features: covariance of all that disturbs them.
        robot: (k, q) what is doubted of the robot does to features, which decays have in common with them; default:
            nothing.
    """
    whose = [*range(len(model.trials)), *model.logged]
    hertz = np.diag([TOLD_TO * model.trials[number].trial.frequency.hz for number in whose])
    correlation = np.where(np.equal.outer(whose, whose), _ALIKE, 0.0) + (1 - _ALIKE) * np.eye(len(whose))
    doubted = model.ring_sensitivities
    apart = block_diag(features, hertz @ correlation @ hertz, np.diag(model.rings_sd**2) + doubted @ doubted.T)
    if robot is not None and robot.shape[1] == doubted.shape[1]:  # else it is not doubted yet
        shared = robot @ doubted.T
        apart[: len(features), len(apart) - len(doubted) :] = shared
        apart[len(apart) - len(doubted) :, : len(features)] = shared.T
    return np.asarray(apart)


def mended(slopes: np.ndarray, step: np.ndarray, change: np.ndarray, sd: np.ndarray) -> np.ndarray:
    """(k, p) slopes (k, p) with which a step (p,) changes the row as it has (k,), and which are else as they were.

    As little changed as that allows, with steps counted in standard deviations (p,) of priors (Broyden 1965).
    """
    along = step * sd**-2.0
    return np.asarray(slopes + np.outer(change - slopes @ step, along) / (along @ step))
