"""A session as one row, and the space in which all that disturbs it has unit size.

A row holds the features of all swims, then how far each beats from its command, and then how free decays ring.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag, solve_triangular

from fitting.model.session_model import SessionModel
from fitting.model.variance import apart
from fitting.trial import MeasuredTrial
from swimmer.fluid import COEFFICIENT_BOUNDS

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
    hertz = [0.0 if trial.commanded_hz is None else trial.filmed_hz - trial.commanded_hz for trial in trials]
    logged = [_off_command(trials[number]) for number in model.logged]
    return np.concatenate([residual, hertz, logged, model.ring_residuals])


def _off_command(trial: MeasuredTrial) -> float:
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
    told = apart(features, model.observed)
    whole = block_diag(told, hertz @ correlation @ hertz, np.diag(model.rings_sd**2) + doubted @ doubted.T)
    if robot is not None and robot.shape[1] == doubted.shape[1]:  # else it is not doubted yet
        shared = robot @ doubted.T
        whole[: len(features), len(whole) - len(doubted) :] = shared
        whole[len(whole) - len(doubted) :, : len(features)] = shared.T
    return np.asarray(whole)


@dataclass(frozen=True, eq=False)
class Whitened:
    """A space in which all that disturbs a session's row of k numbers has unit size and coefficients are free.

    The row holds the features of t trials, and then the numbers beside them.

    Attributes:
        root: (k, k) lower Cholesky factor of the covariance of noise, nuisances and the twin's own discrepancy.
        slopes: (k, 5) of the row with the coefficients.
        precision: (5,) of the prior of the coefficients.
    """

    root: np.ndarray
    slopes: np.ndarray
    precision: np.ndarray

    @classmethod
    def of(cls, covariance: np.ndarray, slopes: np.ndarray, prior_sd: np.ndarray) -> "Whitened":
        """From a covariance (k, k), slopes (k, 5) and the prior's standard deviations (5,)."""
        return cls(np.linalg.cholesky(covariance), slopes, prior_sd**-2.0)

    def projected(self, rows: np.ndarray) -> np.ndarray:
        """(..., k + 5) rows (..., k), whitened, with what coefficients can take away taken; lengths are distances."""
        white = solve_triangular(self.root, rows.reshape(-1, rows.shape[-1]).T, lower=True)  # (k, q)
        slopes = np.vstack([solve_triangular(self.root, self.slopes, lower=True), np.diag(np.sqrt(self.precision))])
        white = np.vstack([white, np.zeros((len(self.precision), white.shape[1]))])
        residual = white - slopes @ np.linalg.lstsq(slopes, white, rcond=None)[0]
        return residual.T.reshape(*rows.shape[:-1], -1)

    @cached_property
    def log_volume(self) -> float:
        """What the logarithm of a row's density has beside half the square of its length, but for a constant."""
        white = solve_triangular(self.root, self.slopes, lower=True)
        freedom = np.diag(self.precision) + white.T @ white
        of_prior = 0.5 * float(np.log(self.precision).sum())
        return of_prior - float(np.log(np.diag(self.root)).sum()) - 0.5 * float(np.linalg.slogdet(freedom)[1])

    def coefficients(self, row: np.ndarray) -> np.ndarray:
        """(5,) by how much coefficients, held back by their prior, best make up for a change (k,)."""
        white, slopes = (solve_triangular(self.root, part, lower=True) for part in (row, self.slopes))
        return np.linalg.solve(slopes.T @ slopes + np.diag(self.precision), slopes.T @ white)

    def length(self, row: np.ndarray) -> float:
        """From the plain twin, refitted, of a change (k,)."""
        return float(np.linalg.norm(self.projected(row)))
