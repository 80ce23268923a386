"""Test of the noise model on which bands and posterior rest: its residual must be white.

`whiteness` looks at a trial's residual in time and between neighbouring markers. All samples of a trial are freed at
once of what the noise model correlates, and of a smooth swim. `noise_flags` says where the model falls short.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular
from scipy.stats import chi2

from fitting.noise import beside
from fitting.trial import HARMONICS
from fitting.trial_model import TrialModel
from swimcal.flags import Flag

# The test of the noise
_LAGS = 20  # largest number of lags
_ENOUGH = 40  # least frames in which a marker, or two neighbours, must be seen
# A session has up to ten such tests: of white noise at most one in a hundred sessions is to fail any.
_OUTSIDE = 0.25  # share of the lags that may lie outside their 95 % band
_BY_CHANCE = 0.999  # share of trials with white noise that stay below the limit of neighbours
_SAMPLES = 2400  # samples that are freed of correlation at once
_DIFFUSE = 1e10  # variance of each number of the smooth swim, against that of a sample
_DETERMINED = 1e3  # standard deviation of a forecast, against that of a sample, below which the swim is determined
_RATES = ("", ", up to the third harmonic")  # the two rows of correlations between neighbours, in words


@dataclass(frozen=True, eq=False)
class Whiteness:
    """Correlation of the residuals of one trial's tracks about a smooth swim, before and after the noise model.

    Attributes:
        trial: name of the trial.
        lag_s: (l,) lags, from one frame on.
        raw: (l,) autocorrelation of the residuals.
        innovations: (l,) autocorrelation of what the model takes for independent.
        limit: bound within which 95 % of the lags of white noise lie.
        neighbours_raw: (2, m - 1) correlation between neighbours from nose to fin, of the residuals: of all rates, and
            of those no faster than the third harmonic of the beat, which features read.
        neighbours: (2, m - 1) the same correlation of what the model takes for independent.
        neighbours_limit: (2,) bound below which their root mean square lies in 99.9 % of trials with white noise.
        frames: number of frames.
        effective: number of independent frames that would determine a mean as well.
        white: share of the noise's variance that is white.
        lasts_s: time in which the correlation of the rest falls to 1/e.
        sd_m: (m,) standard deviation of each marker.
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
        """Root mean square of the correlations between neighbours after the model, (2,)."""
        return _rms(self.neighbours)

    @property
    def neighbour_correlation_raw(self) -> np.ndarray:
        """Root mean square of the correlations between neighbours before the model, (2,)."""
        return _rms(self.neighbours_raw)

    @property
    def in_time(self) -> bool:
        """Return whether at most a quarter of the lags lie outside the limit."""
        return self.outside <= _OUTSIDE

    @property
    def across(self) -> bool:
        """Return whether neighbours are no more correlated after the model than by chance."""
        return not (self.neighbour_correlation > self.neighbours_limit).any()

    @property
    def is_white(self) -> bool:
        """Return whether the residual is white in time and across markers."""
        return self.in_time and self.across

    @property
    def fault(self) -> str:
        """Description of what is not white after the model; an empty text where all is."""
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
    """Flag each trial whose noise is not as the model takes it to be."""
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
    """Test the noise of one trial's tracks; of a long trial, that of its beginning."""
    reader, noise, columns = model.reader, model.noise, beside(model.reader)
    seen = reader.usable.sum(axis=0) >= max(_ENOUGH, 2 * columns.shape[1])
    along_m = model.along_m
    order = np.array([m for m in np.argsort(along_m) if seen[m]], int)
    usable = reader.usable[: _SAMPLES // max(len(order), 1), order]
    scaled = model.trial.position_m[model.trial.kept][: len(usable), order] / noise.sd_m[order, None]
    both = _beside_swim(columns[: len(usable)], scaled, usable), _innovations(columns, scaled, usable, model, order)
    time_s = reader.time_s[: len(usable)]
    lags = range(1, min(_LAGS, len(usable) // 4) + 1)
    raw, innovations = (
        np.array([_correlation(each[:-lag].reshape(-1, 2), each[lag:].reshape(-1, 2)) for lag in lags]) for each in both
    )
    fastest_hz = HARMONICS * np.ptp(reader.turn_rad) / (2 * np.pi * np.ptp(reader.time_s))
    slow = np.exp(-0.5 * (2 * np.pi * fastest_hz * (time_s[:, None] - time_s)) ** 2)
    weights = np.eye(len(time_s)), slow
    pairs = [m for m in range(len(order) - 1) if usable[:, m : m + 2].all(axis=1).sum() >= _ENOUGH]
    neighbours_raw, neighbours = (
        np.array([[_correlation(each[:, m], each[:, m + 1], weight) for m in pairs] for weight in weights])
        for each in both
    )
    chance = np.array([sum(_chance(both[1][:, m : m + 2], weight) for m in pairs) for weight in weights])
    count = max(len(pairs), 1)
    return Whiteness(
        trial=model.trial.name,
        lag_s=float(np.median(np.diff(reader.time_s))) * np.array(lags),
        raw=raw,
        innovations=innovations,
        limit=1.96 / np.sqrt(max(np.isfinite(both[1]).sum(), 1)),
        neighbours_raw=neighbours_raw,
        neighbours=neighbours,
        neighbours_limit=np.sqrt(chi2.ppf(_BY_CHANCE, count) * chance) / count,
        frames=len(reader.time_s),
        effective=noise.effective,
        white=noise.white,
        lasts_s=noise.lasts_s,
        sd_m=noise.sd_m,
    )


def _beside_swim(columns: np.ndarray, scaled: np.ndarray, usable: np.ndarray) -> np.ndarray:
    """Return the residuals (n, m, 2) about a smooth swim, by least squares; nan where a sample does not count."""
    found = np.full(scaled.shape, np.nan)
    for m, own in enumerate(usable.T):
        found[own, m] = scaled[own, m] - columns[own] @ np.linalg.lstsq(columns[own], scaled[own, m], rcond=None)[0]
    return found


def _innovations(
    columns: np.ndarray, scaled: np.ndarray, usable: np.ndarray, model: TrialModel, order: np.ndarray
) -> np.ndarray:
    """Return the innovations (n, m, 2): each sample less its forecast by all before it, over the forecast's sd.

    The smooth swim has a diffuse prior: innovations are independent, but for the first ones, which determine it. Those
    are nan, as samples are that do not count (recursive residuals; Brown, Durbin and Evans 1975).
    """
    noise, time_s = model.noise, model.reader.time_s[: len(usable)]
    frame, place = np.nonzero(usable)
    own, rows, markers = place[:, None] == place, np.ix_(frame, frame), np.ix_(order[place], order[place])
    covariance = np.where(own, noise.correlation(time_s)[rows] + _DIFFUSE * (columns @ columns.T)[rows], 0.0)
    for part in noise.parts:
        covariance += np.where(own, 0.0, part.across[markers] * part.over(time_s)[rows])
    root = np.linalg.cholesky(covariance)
    found = np.full(scaled.shape, np.nan)
    known = np.diag(root) < _DETERMINED
    found[frame[known], place[known]] = solve_triangular(root, scaled[frame, place], lower=True)[known]
    return found


def _correlation(first: np.ndarray, second: np.ndarray, weight: np.ndarray | None = None) -> float:
    """Return the correlation of two series (n, 2) where both count.

    With weights (n, n) it is over products of all pairs, else of each sample with its own.
    """
    counts = np.isfinite(first).all(axis=1) & np.isfinite(second).all(axis=1)
    a, b = first[counts], second[counts]
    left, right = (a, b) if weight is None else (weight[np.ix_(counts, counts)] @ each for each in (a, b))
    return float((left * b).sum() / np.sqrt((left * a).sum() * (right * b).sum()))


def _chance(pair: np.ndarray, weight: np.ndarray) -> float:
    """Return the variance of such a correlation between two markers' white noise (n, 2, 2)."""
    counts = np.isfinite(pair).all(axis=(1, 2))
    own = weight[np.ix_(counts, counts)]
    return float((own**2).sum() / (2 * np.trace(own) ** 2))


def _rms(correlations: np.ndarray) -> np.ndarray:
    return np.asarray(np.sqrt((correlations**2).sum(axis=1) / max(correlations.shape[1], 1)))
