"""Tracking noise that lasts: its size at each marker, how long it stays and what neighbours have of it in common.

Errors of a box stay for several frames, so a trial holds far fewer independent samples than frames. The noise of each
marker is taken as an Ornstein-Uhlenbeck process with a share of white noise (the tracker's grid); where the tracks ask
for it a slow smooth process comes in, for real fish sway beside their beat, and neighbours do so together. All is found
by restricted maximum likelihood (Patterson and Thompson 1971) in what is left beside drift and harmonics.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import brentq, minimize
from threadpoolctl import threadpool_limits

from fitting.model.across_markers import across_markers
from fitting.model.features import FeatureReader, waves
from fitting.model.noise_part import NoisePart, falling

_HARMONICS, _DRIFT = 5, 3
_START = (np.log(0.08), -1.5)  # ln seconds, logit of the white share
_WITH_SWAY = (np.log(0.06), -1.5, np.log(0.25), 0.5)  # and of the sway: ln seconds, logit of its share of the rest
_STEP = 0.8  # of each of these in the first simplex
_PRIOR_SD = 1.5
_WORTH = 10.0  # by which -2 ln likelihood must fall for a sway: chance does that in fewer than one trial in 100
_LEAST_M = 1e-6
_JITTER = 1e-9


@dataclass(frozen=True, eq=False)
class FeatureNoise:
    """Noise of one trial's tracks.

    Attributes:
        sd_m: (m,) of each marker in each coordinate.
        lasts_s: time in which the correlation of its lasting share falls to 1/e.
        white: share of the variance that is white, and each marker's own.
        correlation: (n, n) between frames.
        parts: of the lasting share, with what markers have in common of each; without any, markers are independent.
    """

    sd_m: np.ndarray
    lasts_s: float
    white: float
    correlation: np.ndarray
    parts: tuple[NoisePart, ...] = ()

    @classmethod
    def of_parts(cls, sd_m: np.ndarray, parts: Sequence[NoisePart], time_s: np.ndarray) -> "FeatureNoise":
        """From the lasting parts, for frames at times (n,); what they leave of the variance is white."""
        correlation = np.asarray(sum(part.over(time_s) for part in parts))
        correlation[np.diag_indices_from(correlation)] = 1.0 + _JITTER
        white = 1.0 - sum(part.share for part in parts)
        return cls(sd_m, _lasting(parts), white, correlation, tuple(parts))

    @classmethod
    def typical(cls, noises: Sequence["FeatureNoise"], time_s: np.ndarray) -> "FeatureNoise":
        """What the noises of some trials are like in the mean, for frames at times (n,); sizes are their medians."""
        parts = [replace(part, share=part.share / len(noises)) for noise in noises for part in noise.parts]
        return cls.of_parts(np.median([noise.sd_m for noise in noises], axis=0), parts, time_s)

    @property
    def effective(self) -> float:
        """How many independent frames would determine a mean as well."""
        n = len(self.correlation)
        return float(n**2 / self.correlation.sum())

    def drawn(self, time_s: np.ndarray, random: np.random.Generator) -> np.ndarray:
        """(n, m, 2) errors like these in frames at times (n,), m.

        Raises:
            ValueError: the parts of the noise are not known.
        """
        if not self.parts:
            raise ValueError("parts: found none, expected those of a noise from `noise_of` or `of_parts`")
        shape = (2, len(time_s), len(self.sd_m))
        total = np.sqrt(max(self.white, 0.0)) * random.standard_normal(shape)
        for part in self.parts:
            in_time, across = (
                np.linalg.cholesky(matrix + _JITTER * np.eye(len(matrix)))
                for matrix in (part.over(time_s), part.across)
            )
            total += in_time @ random.standard_normal(shape) @ across.T
        return np.moveaxis(total, 0, -1) * self.sd_m[:, None]

    def covariance(self, reader: FeatureReader) -> np.ndarray:
        """(k, k) of features of these frames."""
        rows = self.sd_m[:, None, None] * reader.readers  # (m, r, n)
        each = np.zeros(rows.shape[:2] * 2)  # (m, r, m, r) between what is read of each marker, either way
        for part in self.parts:
            each += part.across[:, None, :, None] * np.einsum("iam,jbm->iajb", rows @ part.over(reader.time_s), rows)
        for m, own in enumerate(rows):
            each[m, :, m] = own @ self.correlation @ own.T
        both = np.moveaxis(reader.sums, 1, 0).reshape(2, len(reader.sums), -1)  # (2, k, m r)
        return np.asarray(sum(sums @ each.reshape((sums.shape[1],) * 2) @ sums.T for sums in both))


def noise_of(reader: FeatureReader, position_m: np.ndarray) -> FeatureNoise:
    """The noise in positions (n, m, 2) of the frames of features."""
    columns, time_s = smooth_swim(reader), reader.time_s
    groups = _by_mask(reader.usable, position_m, columns.shape[1])
    with threadpool_limits(1):  # the matrices are small: threads cost more than they save
        shares, sd_m = _in_time(groups, columns, time_s, reader.usable.shape[1])
        sd_m = np.where(np.isfinite(sd_m), np.maximum(sd_m, _LEAST_M), np.nanmax(sd_m))
        alone = [NoisePart(*share, np.eye(len(sd_m))) for share in shares]
        apart = FeatureNoise.of_parts(sd_m, alone, time_s)
        across = across_markers(
            position_m / sd_m[:, None], reader.usable, columns, [p.over(time_s) for p in alone], apart.correlation
        )
    parts = [NoisePart(*share, together) for share, together in zip(shares, across, strict=True)]
    return FeatureNoise.of_parts(sd_m, parts, time_s)


def smooth_swim(reader: FeatureReader) -> np.ndarray:
    """(n, 14) drift and harmonics, beside which noise is looked for."""
    scaled = 2 * (reader.time_s - reader.time_s.mean()) / np.ptp(reader.time_s)
    return np.column_stack([scaled**k for k in range(_DRIFT + 1)] + [waves(reader.turn_rad, _HARMONICS)])


class _Share(NamedTuple):
    """Of the variance, that lasts."""

    share: float
    scale_s: float
    smooth: bool


def _plain(x: np.ndarray) -> list[_Share]:
    return [_Share(1.0 - _logistic(x[1]), float(np.exp(x[0])), False)]


def _swaying(x: np.ndarray) -> list[_Share]:
    lasting, sway = 1.0 - _logistic(x[1]), _logistic(x[3])
    return [
        _Share(lasting * (1.0 - sway), float(np.exp(x[0])), False),
        _Share(lasting * sway, float(np.exp(x[2])), True),
    ]


def _in_time(
    groups: Sequence["_Group"], columns: np.ndarray, time_s: np.ndarray, markers: int
) -> tuple[list[_Share], np.ndarray]:
    """The lasting shares, and the (m,) standard deviations; nan for a marker that is hardly seen."""
    lag_s = np.abs(time_s[:, None] - time_s)

    def correlation(shares: Sequence[_Share]) -> np.ndarray:
        matrix = np.asarray(sum(share * falling(lag_s, scale_s, smooth) for share, scale_s, smooth in shares))
        matrix[np.diag_indices_from(matrix)] = 1.0 + _JITTER
        return matrix

    def found(shares_of: Callable[[np.ndarray], list[_Share]], start: np.ndarray) -> tuple[float, list[_Share]]:
        def deviance(x: np.ndarray) -> float:
            matrix = correlation(shares_of(x))
            prior = (((x - start) / _PRIOR_SD) ** 2).sum()
            return sum(group.restricted(columns, matrix)[0] for group in groups) + prior

        simplex = start + _STEP * np.vstack([np.zeros(len(start)), np.eye(len(start))])
        options = {"xatol": 0.03, "fatol": 0.3, "initial_simplex": simplex}
        best = minimize(deviance, start, method="Nelder-Mead", options=options)
        return float(best.fun), shares_of(best.x)

    plain, swaying = found(_plain, np.array(_START)), found(_swaying, np.array(_WITH_SWAY))
    shares = swaying[1] if swaying[0] < plain[0] - _WORTH else plain[1]
    matrix, sd_m = correlation(shares), np.full(markers, np.nan)
    for group in groups:
        sd_m[group.markers] = group.restricted(columns, matrix)[1]
    return shares, sd_m


def _logistic(value: float) -> float:
    return float(1 / (1 + np.exp(-value)))


def _lasting(parts: Sequence[NoisePart]) -> float:
    """In which the correlation of all parts together falls to 1/e, s."""

    def above(lag_s: float) -> float:
        return float(sum(p.share * (falling(np.array(lag_s), p.scale_s, p.smooth) - np.exp(-1)) for p in parts))

    return float(brentq(above, 0.0, 2.0 * max(part.scale_s for part in parts)))


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
        residual = self.series - design @ np.linalg.solve(information, solved.T @ self.series)
        squares = (residual * cho_solve(factor, residual)).sum(axis=0)  # (2 g,)
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
