"""Is the noise of the tracks as the model has it? What it leaves must be white, in time and between neighbours.

All samples of a trial are freed at once of what the noise model correlates, and of a smooth swim.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular
from scipy.stats import chi2

from fitting.model.features import HARMONICS
from fitting.model.noise import FeatureNoise, smooth_swim
from fitting.model.trial_model import TrialModel
from session import Flag

_LAGS = 20
_ENOUGH = 40  # frames that a marker, or two neighbours, must be seen in
_OUTSIDE = 0.2  # share of the lags that may lie outside their 95 % band
_BY_CHANCE = 0.99  # of trials with white noise stay below the limit of neighbours
_SAMPLES = 2400  # that are freed of correlation at once
_RATES = ("", ", up to the third harmonic")


@dataclass(frozen=True, eq=False)
class Whiteness:
    """Correlation of the residuals of one trial's tracks about a smooth swim, before and after the noise model.

    Attributes:
        lag_s: (l,) from one frame on.
        raw: (l,) autocorrelation of the residuals.
        innovations: (l,) of what the model takes for independent.
        limit: within which 95 % of the lags of white noise lie.
        neighbours_raw: (2, m - 1) correlation between neighbours from nose to fin, of the residuals: of all rates, and
            of what is no faster than the third harmonic of the beat, which features read.
        neighbours: (2, m - 1) of what the model takes for independent.
        neighbours_limit: (2,) below which the root mean square of these lies in 99 % of trials with white noise.
        effective: how many independent frames would determine a mean as well.
        white: share of the noise's variance that is white.
        lasts_s: in which the correlation of the rest falls to 1/e.
        sd_m: (m,) of each marker.
    """

    trial: str
    lag_s: np.ndarray
    raw: np.ndarray
    innovations: np.ndarray
    limit: float
    neighbours_raw: np.ndarray
    neighbours: np.ndarray
    neighbours_limit: np.ndarray
    frames: int
    effective: float
    white: float
    lasts_s: float
    sd_m: np.ndarray

    @property
    def outside(self) -> float:
        """Share of the lags that lie outside the limit."""
        return float((np.abs(self.innovations) > self.limit).mean())

    @property
    def neighbour_correlation(self) -> np.ndarray:
        """(2,) root mean square of the correlations between neighbours after the model."""
        return _rms(self.neighbours)

    @property
    def neighbour_correlation_raw(self) -> np.ndarray:
        """(2,) the same of the residuals."""
        return _rms(self.neighbours_raw)

    @property
    def in_time(self) -> bool:
        """Whether no more lags lie outside the limit than a fifth of them."""
        return self.outside <= _OUTSIDE

    @property
    def across(self) -> bool:
        """Whether neighbours are no more alike after the model than by chance."""
        return not (self.neighbour_correlation > self.neighbours_limit).any()

    @property
    def is_white(self) -> bool:
        """In time and across markers."""
        return self.in_time and self.across

    @property
    def fault(self) -> str:
        """What is not white after the model, in words; empty where all is."""
        said = []
        if not self.in_time:
            said.append(
                f"{100 * self.outside:.0f} % of the lags lie outside the band of white noise, at most "
                f"{100 * _OUTSIDE:.0f} % may"
            )
        if not self.across:
            worst = int(np.argmax(self.neighbour_correlation / self.neighbours_limit))
            said.append(
                f"neighbouring markers correlate by {self.neighbour_correlation[worst]:.2f} (root mean square"
                f"{_RATES[worst]}), at most {self.neighbours_limit[worst]:.2f} is chance"
            )
        return " and ".join(said)


def noise_flags(found: Sequence[Whiteness]) -> list[Flag]:
    """One for each trial whose noise is not as the model takes it to be."""
    return [
        Flag(
            "noise_not_white",
            message=f"{one.trial}: what the noise model leaves of the tracks is not white: {one.fault}; "
            "intervals may be too narrow or too wide",
        )
        for one in found
        if not one.is_white
    ]


def whiteness(model: TrialModel) -> Whiteness:
    """Of one trial's tracks; of a long trial its beginning."""
    reader, noise = model.reader, model.noise
    position_m, columns = model.trial.position_m[model.trial.kept], smooth_swim(reader)
    seen = reader.usable.sum(axis=0) >= max(_ENOUGH, 2 * columns.shape[1])
    along_m = model.twin.robot.marker_positions_m(model.trial.markers)[:, 0]
    order = np.array([m for m in np.argsort(along_m) if seen[m]], int)
    at, samples = _whitened(columns, position_m, reader.usable, reader.time_s, noise, order)
    lags = range(1, min(_LAGS, len(at) // 4) + 1)
    in_time = np.array([_pair(samples, *_both(at[:-lag].ravel(), at[lag:].ravel())) for lag in lags]).reshape(-1, 3)
    lag_s = float(np.median(np.diff(reader.time_s))) * np.array(lags)
    fastest_hz = HARMONICS * np.ptp(reader.turn_rad) / (2 * np.pi * np.ptp(reader.time_s))
    time_s = reader.time_s[: len(at)]
    slow = np.exp(-0.5 * (2 * np.pi * fastest_hz * (time_s[:, None] - time_s)) ** 2)
    found = []
    for first, second in zip(at.T[:-1], at.T[1:], strict=True):
        both = (first >= 0) & (second >= 0)
        if both.sum() >= _ENOUGH:
            weights = (None, slow[np.ix_(both, both)])
            found.append([_pair(samples, first[both], second[both], weight) for weight in weights])
    raw, innovations, variance = np.moveaxis(np.array(found).reshape(-1, 2, 3), -1, 0).swapaxes(1, 2)  # (2, m - 1) each
    count = max(len(found), 1)
    return Whiteness(
        trial=model.trial.name,
        lag_s=lag_s,
        raw=in_time[:, 0],
        innovations=in_time[:, 1],
        limit=1.96 / np.sqrt(max(2 * len(samples.white), 1)),
        neighbours_raw=raw,
        neighbours=innovations,
        neighbours_limit=np.sqrt(chi2.ppf(_BY_CHANCE, count) * variance.sum(axis=1)) / count,
        frames=len(reader.time_s),
        effective=noise.effective,
        white=noise.white,
        lasts_s=noise.lasts_s,
        sd_m=noise.sd_m,
    )


class _Samples(NamedTuple):
    """Of s samples: (s, 2) residuals about a smooth swim, and innovations; (s, c) what that swim took of these."""

    raw: np.ndarray
    white: np.ndarray
    basis: np.ndarray


def _whitened(
    columns: np.ndarray,
    position_m: np.ndarray,
    usable: np.ndarray,
    time_s: np.ndarray,
    noise: FeatureNoise,
    order: np.ndarray,
) -> tuple[np.ndarray, _Samples]:
    """(n, m) number of each sample of markers in this order, by time and then along the body; -1: does not count."""
    counts = usable[: _SAMPLES // max(len(order), 1), order]
    frame, place = np.nonzero(counts)
    marker = order[place]
    own, rows = marker[:, None] == marker, np.ix_(frame, frame)
    covariance = np.where(own, noise.correlation[rows], 0.0)
    for part in noise.parts:
        covariance += np.where(own, 0.0, part.across[np.ix_(marker, marker)] * part.over(time_s)[rows])
    root = np.linalg.cholesky(covariance)
    design = (columns[frame][:, None] * (place[:, None] == np.arange(len(order)))[..., None]).reshape(len(frame), -1)
    basis = np.linalg.qr(solve_triangular(root, design, lower=True))[0]
    white = solve_triangular(root, position_m[frame, marker] / noise.sd_m[marker, None], lower=True)
    white = white - basis @ (basis.T @ white)
    at = np.full(counts.shape, -1)
    at[frame, place] = np.arange(len(frame))
    return at, _Samples(root @ white, white, basis)


def _both(first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    counts = (first >= 0) & (second >= 0)
    return first[counts], second[counts]


def _pair(
    samples: _Samples, first: np.ndarray, second: np.ndarray, weight: np.ndarray | None = None
) -> tuple[float, float, float]:
    """Correlation of samples with numbers (k,) and (k,), raw and of the innovations, and its variance by chance.

    What the smooth swim takes away correlates innovations a little; that is put back. With weights (k, k) of products
    those of all pairs count, else those of each with its own.
    """
    spent, other = samples.basis[first], samples.basis[second]
    if weight is None:
        kept = 1 - (spent**2).sum(axis=1), 1 - (other**2).sum(axis=1)
        size = np.sqrt(kept[0].sum() * kept[1].sum())
        expected, scatter = -(spent * other).sum() / size, len(first) / (2 * size**2)
    else:
        a, b = (np.eye(len(each)) - each @ each.T for each in (spent, other))
        size = np.sqrt((weight * a).sum() * (weight * b).sum())
        expected = -(weight * (spent @ other.T)).sum() / size
        scatter = ((weight @ a) * (weight @ b).T).sum() / (2 * size**2)
    raw, white = (
        _neighbour_correlation(series[first], series[second], weight) for series in (samples.raw, samples.white)
    )
    return raw, white - float(expected), float(scatter)


def _neighbour_correlation(a: np.ndarray, b: np.ndarray, weight: np.ndarray | None) -> float:
    def product(x: np.ndarray, y: np.ndarray) -> float:
        return float((x * y).sum() if weight is None else (x * (weight @ y)).sum())

    return product(a, b) / np.sqrt(product(a, a) * product(b, b))


def _rms(correlations: np.ndarray) -> np.ndarray:
    return np.asarray(np.sqrt((correlations**2).sum(axis=1) / max(correlations.shape[1], 1)))
