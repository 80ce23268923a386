"""Least squares under tracking errors that last, with their share and duration found by restricted likelihood.

The errors of a marker are taken as a first-order autoregressive part (an Ornstein-Uhlenbeck process at the frames) and
a white one, such as rounding to half pixels. Restricted likelihood (Patterson and Thompson 1971) allows for what the
regression has eaten of them; the result of `regress` is averaged over all durations and shares tried, by their
likelihood; `descend` steps under noise that is known. Errors that markers share in a frame widen the intervals (the
"sandwich" of Liang and Zeger 1986 over markers).
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve, cholesky, solve_triangular
from scipy.special import softmax

from tracking.body_model import rows_alike

DURATIONS_S = (0.0, 0.02, 0.04, 0.07, 0.1, 0.15, 0.25, 0.5)  # durations that are tried
WHITE_SHARES = (0.03, 0.12, 0.3)  # white shares that are tried with each but 0


@dataclass(frozen=True)
class LastingNoise:
    """Errors of one marker: how long they last (to 1/e), the share of the variance that is white, their size."""

    duration_s: float
    white_share: float
    sd_m: float


@dataclass(frozen=True, eq=False)
class Regression:
    """A linear regression under correlated noise: (p,) estimate, (p, p) covariance, and the likeliest noise."""

    step: np.ndarray
    covariance: np.ndarray
    noise: LastingNoise


@dataclass(frozen=True, eq=False)
class RegressionProblem:
    """A model near its parameters.

    Attributes:
        time_s: (n,) s.
        used: (n, k) True where a sample counts.
        residual: (n, k) measured minus modelled, m.
        jacobian: (n, k, p) of the model.
        pull: (p,) pull towards the parameters' prior: precision times (prior mean minus parameters).
        precision: (p,) precision of the prior; 0: none.
    """

    time_s: np.ndarray
    used: np.ndarray
    residual: np.ndarray
    jacobian: np.ndarray
    pull: np.ndarray
    precision: np.ndarray

    @property
    def stacked(self) -> np.ndarray:
        """Jacobian and residual in one array, (n, k, p + 1)."""
        return np.concatenate([self.jacobian, self.residual[..., None]], axis=2)


def regress(model: RegressionProblem) -> Regression:
    """Return the step towards the best parameters, averaged over the noise that may be there."""
    choices = [(d, s) for d in DURATIONS_S for s in (WHITE_SHARES if d else (0.0,))]
    solved, deviances = zip(*(_solve(model, *choice) for choice in choices), strict=True)
    chance = softmax(-np.array(deviances) / 2)
    step = np.einsum("c,cp->p", chance, np.stack([one.step for one in solved]))
    covariance = np.zeros((len(step), len(step)))
    for weight, one in zip(chance, solved, strict=True):
        covariance += weight * (one.covariance + np.outer(one.step - step, one.step - step))
    return Regression(step, covariance, solved[int(np.argmax(chance))].noise)


def descend(model: RegressionProblem, noise: LastingNoise) -> Regression:
    """Return the Gauss-Newton step for noise that is known."""
    white = whitened(model.time_s, model.used, model.stacked, noise)[0] / noise.sd_m
    jacobian, residual = white[..., :-1], white[..., -1]
    normal = np.einsum("nkp,nkq->pq", jacobian, jacobian) + np.diag(model.precision)
    covariance = np.linalg.inv(normal)
    return Regression(covariance @ (np.einsum("nkp,nk->p", jacobian, residual) + model.pull), covariance, noise)


def whitened(time_s: np.ndarray, used: np.ndarray, series: np.ndarray, noise: LastingNoise) -> tuple[np.ndarray, float]:
    """Return the series (n, k, c) whitened to the variance sd^2 of the noise, and the log determinant.

    Args:
        time_s: (n,) s.
        used: (n, k) True where a sample counts.
        series: (n, k, c).
        noise: duration and white share of the noise.
    """
    if noise.duration_s > 0:
        lasting = np.exp(-np.abs(time_s[:, None] - time_s) / noise.duration_s)
    else:
        lasting = np.eye(len(time_s))
    correlation = (1 - noise.white_share) * lasting + noise.white_share * np.eye(len(time_s))
    white, log_volume = np.zeros_like(series), 0.0
    for pattern, markers in rows_alike(used.T):
        rows = np.flatnonzero(pattern)
        if not len(rows):
            continue
        root = cholesky(correlation[np.ix_(rows, rows)], lower=True)
        of_pattern = series[np.ix_(rows, markers)]  # (r, m, c)
        solved = solve_triangular(root, of_pattern.reshape(len(rows), -1), lower=True)
        white[np.ix_(rows, markers)] = solved.reshape(of_pattern.shape)
        log_volume += 2 * len(markers) * float(np.log(np.diag(root)).sum())
    return white, log_volume


def _solve(model: RegressionProblem, duration_s: float, white_share: float) -> tuple[Regression, float]:
    """Fit the regression under noise of one duration and white share, and its size; also return the deviance."""
    unit = LastingNoise(duration_s, white_share, 1.0)
    white, log_volume = whitened(model.time_s, model.used, model.stacked, unit)
    jacobian, residual = white[..., :-1], white[..., -1]
    curvature = np.einsum("nkp,nkq->pq", jacobian, jacobian)
    moment = np.einsum("nkp,nk->p", jacobian, residual)
    free = max(int(model.used.sum()) - len(moment), 1)
    variance = _variance(model, curvature, moment, float((residual**2).sum()), free)
    normal = cholesky(curvature / variance + np.diag(model.precision) + 1e-12 * np.eye(len(moment)), lower=True)
    step = cho_solve((normal, True), moment / variance + model.pull)
    fresh = residual - jacobian @ step  # (n, k) innovations
    deviance = free * np.log(variance) + log_volume + 2 * float(np.log(np.diag(normal)).sum())
    deviance += len(moment) * np.log(variance)
    shared = fresh.T @ fresh  # (k, k)
    shared *= variance * shared.shape[0] / max(float(np.trace(shared)), 1e-300)
    pushed = np.einsum("nkp,kl->nlp", jacobian, shared)
    meat = np.einsum("nkp,nkq->pq", pushed, jacobian) / variance**2 + np.diag(model.precision)
    inverse = cho_solve((normal, True), np.eye(len(moment)))
    noise = LastingNoise(duration_s, white_share, float(np.sqrt(variance)))
    return Regression(step, inverse @ meat @ inverse, noise), deviance


def _variance(model: RegressionProblem, curvature: np.ndarray, moment: np.ndarray, total: float, free: int) -> float:
    """Return the variance of the innovations, around the regression that its own size lets the prior bend."""
    variance = 1e-6  # (1 mm)^2
    for _ in range(3):
        normal = curvature / variance + np.diag(model.precision) + 1e-12 * np.eye(len(moment))
        step = np.linalg.solve(normal, moment / variance + model.pull)
        squares = total - 2 * step @ moment + step @ curvature @ step
        variance = max(squares, 0.0) / free + 1e-14
    return variance
