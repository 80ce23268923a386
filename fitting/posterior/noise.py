"""Tracking noise that lasts: its size at each marker and how long it stays, from what no smooth swim explains.

Errors of a box stay for several frames, so a trial holds far fewer independent samples than frames. The noise of each
marker is taken as an Ornstein-Uhlenbeck process with a share of white noise (the tracker's grid), found by restricted
maximum likelihood (Patterson and Thompson 1971) in what is left beside drift and harmonics.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize
from threadpoolctl import threadpool_limits

from fitting.posterior.gait import Gait, waves

_HARMONICS, _DRIFT = 5, 3
_START = (np.log(0.08), -1.5)  # ln seconds, logit of the white share
_SIMPLEX = np.array([[0.0, 0.0], [0.7, 0.0], [0.0, 1.0]])
_LEAST_M = 1e-6
_JITTER = 1e-9


@dataclass(frozen=True, eq=False)
class GaitNoise:
    """Noise of one trial's tracks.

    Attributes:
        sd_m: (m,) of each marker in each coordinate.
        lasts_s: time in which the correlation of its lasting share falls to 1/e.
        white: share of the variance that is white.
        correlation: (n, n) between frames.
        effective: number of independent frames that would tell as much of a mean.
    """

    sd_m: np.ndarray
    lasts_s: float
    white: float
    correlation: np.ndarray

    @property
    def effective(self) -> float:
        """How many independent frames would determine a mean as well."""
        n = len(self.correlation)
        return float(n**2 / self.correlation.sum())

    def covariance(self, gait: Gait) -> np.ndarray:
        """(k, k) of a gait of these frames."""
        beat = gait.beat_reader  # (m, 7, n)
        speed = gait.speed_reader  # (m, n)
        markers, columns, _ = beat.shape
        total = np.zeros((1 + 2 * markers * columns,) * 2)
        for m, (readers, along) in enumerate(zip(beat, speed, strict=True)):
            rows = np.vstack([along, readers])  # (8, n)
            own = self.sd_m[m] ** 2 * rows @ self.correlation @ rows.T
            first = 1 + 2 * columns * m
            x, y = np.arange(first, first + columns), np.arange(first + columns, first + 2 * columns)
            total[0, 0] += own[0, 0]
            total[0, x] = total[x, 0] = own[0, 1:]
            total[np.ix_(x, x)] = total[np.ix_(y, y)] = own[1:, 1:]
        return total


def noise_of(gait: Gait, position_m: np.ndarray) -> GaitNoise:
    """The noise in positions (n, m, 2) of the frames of a gait."""
    time_s = gait.time_s
    scaled = 2 * (time_s - time_s.mean()) / np.ptp(time_s)
    columns = np.column_stack([scaled**k for k in range(_DRIFT + 1)] + [waves(gait.turn_rad, _HARMONICS)])
    groups = _by_mask(gait.usable, position_m, columns.shape[1])
    lag_s = np.abs(time_s[:, None] - time_s[None])

    def correlation(x: np.ndarray) -> np.ndarray:
        white = 1 / (1 + np.exp(-x[1]))
        matrix = (1 - white) * np.exp(-lag_s / np.exp(x[0]))
        matrix[np.diag_indices_from(matrix)] = 1.0 + _JITTER
        return matrix

    def deviance(x: np.ndarray) -> float:
        matrix = correlation(x)
        prior = 0.5 * ((x[0] - _START[0]) / 1.5) ** 2 + 0.5 * ((x[1] - _START[1]) / 1.5) ** 2
        return sum(group.restricted(columns, matrix)[0] for group in groups) + 2 * prior

    with threadpool_limits(1):  # the matrices are small: threads cost more than they save
        options = {"xatol": 0.03, "fatol": 0.3, "initial_simplex": _START + _SIMPLEX}
        found = minimize(deviance, np.array(_START), method="Nelder-Mead", options=options).x
    matrix = correlation(found)
    sd_m = np.full(gait.usable.shape[1], np.nan)
    for group in groups:
        sd_m[group.markers] = group.restricted(columns, matrix)[1]
    sd_m = np.where(np.isfinite(sd_m), np.maximum(sd_m, _LEAST_M), np.nanmax(sd_m))
    return GaitNoise(sd_m, float(np.exp(found[0])), float(1 / (1 + np.exp(-found[1]))), matrix)


@dataclass(frozen=True, eq=False)
class _Group:
    """Markers seen in the same frames: (k,) frames, (g,) markers, (k, 2 g) series."""

    frames: np.ndarray
    markers: np.ndarray
    series: np.ndarray

    def restricted(self, columns: np.ndarray, correlation: np.ndarray) -> tuple[float, np.ndarray]:
        """-2 ln of the restricted likelihood, and (g,) standard deviations."""
        factor = cho_factor(correlation[np.ix_(self.frames, self.frames)], lower=True)
        design = columns[self.frames]
        solved = cho_solve(factor, design)
        information = design.T @ solved
        left = self.series - design @ np.linalg.solve(information, solved.T @ self.series)
        squares = (left * cho_solve(factor, left)).sum(axis=0)  # (2 g,)
        freedom = len(self.frames) - columns.shape[1]
        variance = squares.reshape(-1, 2).mean(axis=1) / freedom + _LEAST_M**2  # (g,)
        volume = 2 * np.log(np.diag(factor[0])).sum() + np.linalg.slogdet(information)[1]
        return float(2 * (freedom * np.log(variance)).sum() + len(squares) * volume), np.sqrt(variance)


def _by_mask(usable: np.ndarray, position_m: np.ndarray, columns: int) -> list[_Group]:
    masks, which = np.unique(usable, axis=1, return_inverse=True)
    groups = []
    for number, mask in enumerate(masks.T):
        frames, markers = np.flatnonzero(mask), np.flatnonzero(which == number)
        if len(frames) > 2 * columns:
            groups.append(_Group(frames, markers, position_m[np.ix_(frames, markers)].reshape(len(frames), -1)))
    return groups
