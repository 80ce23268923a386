"""Do neighbouring markers still err together after the noise model? All samples of a trial are whitened at once."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular
from scipy.stats import chi2

from fitting.model.noise import GaitNoise

_ENOUGH = 40  # frames that both must be seen in
_BY_CHANCE = 0.99  # of trials with white noise stay below the limit
_SAMPLES = 2400  # that are freed of all correlation at once


class Neighbours(NamedTuple):
    """Correlations between neighbours along the body: of all rates, and of the slow ones alone.

    Attributes:
        raw: (2, m - 1) of the residuals.
        left: (2, m - 1) of what the model takes for independent.
        limit: (2,) below which the root mean square of these lies in 99 % of trials with white noise.
    """

    raw: np.ndarray
    left: np.ndarray
    limit: np.ndarray


@dataclass(frozen=True, eq=False)
class JointSamples:
    """Samples of all markers at once, by time and then along the body, freed of what the noise model correlates.

    Attributes:
        at: (n, m) number of each sample; -1 for what does not count.
        raw: (s, 2) beside a smooth swim.
        white: (s, 2) innovations.
        basis: (s, c) what the smooth swim took away of these.
    """

    at: np.ndarray
    raw: np.ndarray
    white: np.ndarray
    basis: np.ndarray

    @classmethod
    def of(
        cls,
        columns: np.ndarray,
        position_m: np.ndarray,
        usable: np.ndarray,
        time_s: np.ndarray,
        noise: GaitNoise,
        order: np.ndarray,
    ) -> "JointSamples":
        """Of positions (n, m, 2) of markers in this order; of a long trial its beginning."""
        counts = usable[: _SAMPLES // max(len(order), 1), order]
        frame, place = np.nonzero(counts)
        marker = order[place]
        own, rows = marker[:, None] == marker, np.ix_(frame, frame)
        covariance = np.where(own, noise.correlation[rows], 0.0)
        for part in noise.parts:
            covariance += np.where(own, 0.0, part.across[np.ix_(marker, marker)] * part.over(time_s)[rows])
        root = np.linalg.cholesky(covariance)
        design = (columns[frame][:, None] * (place[:, None] == np.arange(len(order)))[..., None]).reshape(
            len(frame), -1
        )
        basis = np.linalg.qr(solve_triangular(root, design, lower=True))[0]
        white = solve_triangular(root, position_m[frame, marker] / noise.sd_m[marker, None], lower=True)
        white = white - basis @ (basis.T @ white)
        at = np.full(counts.shape, -1)
        at[frame, place] = np.arange(len(frame))
        return cls(at, root @ white, white, basis)


def neighbours(joint: JointSamples, time_s: np.ndarray, fastest_hz: float) -> Neighbours:
    """Of the samples of frames at times (n,); the slow rates are those up to the fastest that is given."""
    lags = 2 * np.pi * fastest_hz * (time_s[:, None] - time_s)
    slow, every = np.exp(-0.5 * lags**2), np.eye(len(time_s))
    found = [
        [_pair(joint, weight[np.ix_(both, both)], first[both], second[both]) for weight in (every, slow)]
        for first, second in zip(joint.at.T[:-1], joint.at.T[1:], strict=True)
        if (both := (first >= 0) & (second >= 0)).sum() >= _ENOUGH
    ]
    raw, left, variance = np.moveaxis(np.array(found).reshape(-1, 2, 3), -1, 0).swapaxes(1, 2)  # (2, m - 1) each
    count = max(len(found), 1)
    return Neighbours(raw, left, np.sqrt(chi2.ppf(_BY_CHANCE, count) * variance.sum(axis=1)) / count)


def _pair(joint: JointSamples, weight: np.ndarray, first: np.ndarray, second: np.ndarray) -> tuple[float, float, float]:
    """Correlation of two markers, raw and left, and the variance of that by chance.

    Args:
        joint: all samples.
        weight: (k, k) of the products of their samples.
        first, second: (k,) numbers of the samples of each.
    """
    a, b = (np.eye(len(each)) - joint.basis[each] @ joint.basis[each].T for each in (first, second))
    size = np.sqrt((weight * a).sum() * (weight * b).sum())
    expected = -(weight * (joint.basis[first] @ joint.basis[second].T)).sum() / size
    scatter = ((weight @ a) * (weight @ b).T).sum() / (2 * size**2)
    raw, left = (_alike(series[first], series[second], weight) for series in (joint.raw, joint.white))
    return raw, left - expected, scatter


def _alike(a: np.ndarray, b: np.ndarray, weight: np.ndarray) -> float:
    """Correlation of series (k, 2) with weights (k, k) of their products."""
    both, one, other = ((weight * (x @ y.T)).sum() for x, y in ((a, b), (a, a), (b, b)))
    return float(both / np.sqrt(one * other))
