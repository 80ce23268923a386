"""A session as one row, and the whitened space in which all that disturbs it has unit size.

A row holds the features of all swims, then the differences of their frequencies from the commands, and then the numbers
of free decays.
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
_ALIKE = 0.8  # correlation of the errors of tail and motor's log: both do what the motor does
_LEAST = 0.01  # least coefficient for the Jacobian: nearer to 0 steps are lost in the twin's roughness
_STEP = 0.02  # finite difference of the root of a coefficient, either way
LONG = 10.0
"""Whitened norm of a step after which the Jacobian is simulated anew."""


def residual_row(model: SessionModel, at: np.ndarray) -> np.ndarray:
    """Return the residual (k + b,) of the features, and of the numbers after them.

    The residual of frequencies is their difference from the commands, Hz: first those of all tails, as filmed, then
    those of the motors that were logged; and then of free decays.

    Args:
        model: the session.
        at: (5,) coefficients of the twin.
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
    """Return the Jacobian (k + b, 5) of the row by the coefficients, on which only features depend.

    Its steps are even in the roots of the coefficients.

    Args:
        model: the session.
        at: (5,) coefficients of the twin.
    """
    roots = np.sqrt(np.maximum(at, _LEAST)) + _STEP * np.vstack([np.eye(5), -np.eye(5)])
    points = np.clip(roots, 0.0, np.sqrt(COEFFICIENT_BOUNDS[1])) ** 2
    features = model.simulated(points)
    slopes = (features[:5] - features[5:]) / np.diag(points[:5] - points[5:])[:, None]
    return np.vstack([slopes.T, np.zeros((model.beside, 5))])


def row_covariance(model: SessionModel, features: np.ndarray, robot: np.ndarray | None = None) -> np.ndarray:
    """Return the covariance (k + b, k + b) of a row; frequencies are as far off their commands as motors are.

    Args:
        model: the swims.
        features: (k, k) covariance of all that disturbs them.
        robot: (k, q) effect of the robot's uncertain numbers on features, which decays have in common with them;
            default: nothing.
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

    The row holds the features of t trials, and then the numbers after them.

    Attributes:
        root: (k, k) lower Cholesky factor of the covariance of noise, nuisances and the twin's own discrepancy.
        slopes: (k, 5) Jacobian of the row by the coefficients.
        precision: (5,) precision of the prior of the coefficients.
    """

    root: np.ndarray
    slopes: np.ndarray
    precision: np.ndarray

    @classmethod
    def of(cls, covariance: np.ndarray, slopes: np.ndarray, prior_sd: np.ndarray) -> "Whitened":
        """Build the space.

        Args:
            covariance: (k, k) of the row.
            slopes: (k, 5) Jacobian of the row by the coefficients.
            prior_sd: (5,) standard deviations of the prior of the coefficients.
        """
        return cls(np.linalg.cholesky(covariance), slopes, prior_sd**-2.0)

    def projected(self, rows: np.ndarray) -> np.ndarray:
        """Return rows (..., k) whitened, less what coefficients can explain, (..., k + 5); norms are distances."""
        white = solve_triangular(self.root, rows.reshape(-1, rows.shape[-1]).T, lower=True)  # (k, q)
        slopes = np.vstack([solve_triangular(self.root, self.slopes, lower=True), np.diag(np.sqrt(self.precision))])
        white = np.vstack([white, np.zeros((len(self.precision), white.shape[1]))])
        residual = white - slopes @ np.linalg.lstsq(slopes, white, rcond=None)[0]
        return residual.T.reshape(*rows.shape[:-1], -1)

    @cached_property
    def log_volume(self) -> float:
        """Part of the logarithm of a row's density besides half the square of its norm, up to a constant."""
        white = solve_triangular(self.root, self.slopes, lower=True)
        freedom = np.diag(self.precision) + white.T @ white
        of_prior = 0.5 * float(np.log(self.precision).sum())
        return of_prior - float(np.log(np.diag(self.root)).sum()) - 0.5 * float(np.linalg.slogdet(freedom)[1])

    def coefficients(self, row: np.ndarray) -> np.ndarray:
        """Return the change (5,) of coefficients that best makes up for a change (k,) of the row.

        The prior holds it back.
        """
        white, slopes = (solve_triangular(self.root, part, lower=True) for part in (row, self.slopes))
        return np.linalg.solve(slopes.T @ slopes + np.diag(self.precision), slopes.T @ white)

    def length(self, row: np.ndarray) -> float:
        """Return the norm of a change (k,) of the row after coefficients are refitted."""
        return float(np.linalg.norm(self.projected(row)))
