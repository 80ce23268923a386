"""Is the noise of the tracks as the posterior takes it to be? What it leaves must be white."""

from dataclasses import dataclass

import numpy as np

from fitting.posterior.gait import waves
from fitting.posterior.trial_model import TrialModel

_HARMONICS, _DRIFT = 5, 3  # of the smooth swim that is taken out, as where the noise was found
_LAGS = 20
_ENOUGH = 40  # frames that a marker must be seen in


@dataclass(frozen=True, eq=False)
class Whiteness:
    """Autocorrelation of one trial's tracks beside a smooth swim, before and after the noise model, over all markers.

    Attributes:
        trial: its name.
        lag_s: (l,) from one frame on.
        raw: (l,) of the residuals.
        modelled: (l,) of the residuals as the noise model says they should be.
        left: (l,) of what the model takes for independent (innovations).
        limit: within which 95 % of the lags of white noise lie.
        frames: of the trial.
        effective: how many independent frames would determine a mean as well.
        white: share of the noise's variance that is white.
        lasts_s: in which the correlation of the rest falls to 1/e.
        sd_m: (m,) of each marker.
    """

    trial: str
    lag_s: np.ndarray
    raw: np.ndarray
    modelled: np.ndarray
    left: np.ndarray
    limit: float
    frames: int
    effective: float
    white: float
    lasts_s: float
    sd_m: np.ndarray

    @property
    def is_white(self) -> bool:
        """Whether no more lags lie outside the limit than a fifth of them."""
        return bool((np.abs(self.left) > self.limit).mean() <= 0.2)


def whiteness(model: TrialModel) -> Whiteness:
    """Of one trial's tracks."""
    gait, noise = model.gait, model.noise
    position_m = model.trial.position_m[model.trial.kept]
    scaled = 2 * (gait.time_s - gait.time_s.mean()) / np.ptp(gait.time_s)
    columns = np.column_stack([scaled**k for k in range(_DRIFT + 1)] + [waves(gait.turn_rad, _HARMONICS)])
    lags = min(_LAGS, len(gait.time_s) // 4)
    found = [
        _correlations(columns[seen], marker_m[seen], noise.correlation[np.ix_(seen, seen)], lags)
        for seen, marker_m in zip(gait.usable.T, np.swapaxes(position_m, 0, 1), strict=True)
        if seen.sum() >= max(_ENOUGH, 2 * columns.shape[1])
    ]
    raw, modelled, left = np.mean(found, axis=0) if found else np.full((3, lags), np.nan)
    frame_s = float(np.median(np.diff(gait.time_s)))
    return Whiteness(
        trial=model.trial.name,
        lag_s=frame_s * np.arange(1, lags + 1),
        raw=raw,
        modelled=modelled,
        left=left,
        limit=1.96 / np.sqrt(max(2 * len(found), 1) * len(gait.time_s)),
        frames=len(gait.time_s),
        effective=noise.effective,
        white=noise.white,
        lasts_s=noise.lasts_s,
        sd_m=noise.sd_m,
    )


def _correlations(columns: np.ndarray, series: np.ndarray, correlation: np.ndarray, lags: int) -> np.ndarray:
    """(3, l) autocorrelation of what generalised least squares on columns (k, c) leaves of a series (k, 2).

    As it is; as the noise model says it should be, for the fit takes some away; and after the model, where what the fit
    takes away is put back.
    """
    root = np.linalg.cholesky(correlation)
    basis = np.linalg.qr(np.linalg.solve(root, columns))[0]  # (k, c)
    white = np.linalg.solve(root, series)
    white = white - basis @ (basis.T @ white)
    spent = root @ basis
    raw, modelled = _lagged(root @ white, lags), _of_covariance(correlation - spent @ spent.T, lags)
    left = _lagged(white, lags) - _of_covariance(np.eye(len(basis)) - basis @ basis.T, lags)
    return np.stack([raw, modelled, left])


def _lagged(series: np.ndarray, lags: int) -> np.ndarray:
    """(l,) mean autocorrelation of columns (k, c) at lags from one on."""
    total = (series**2).sum(axis=0)
    return np.array([((series[lag:] * series[:-lag]).sum(axis=0) / total).mean() for lag in range(1, lags + 1)])


def _of_covariance(covariance: np.ndarray, lags: int) -> np.ndarray:
    """(l,) expected autocorrelation of a series with this covariance (k, k)."""
    return np.array([np.trace(covariance, lag) for lag in range(1, lags + 1)]) / np.trace(covariance)
