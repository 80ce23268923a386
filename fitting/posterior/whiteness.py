"""Is the noise of the tracks as the posterior has it? What it leaves must be white, in time and across markers."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting.model.features import HARMONICS
from fitting.model.noise import smooth_swim
from fitting.model.trial_model import TrialModel
from fitting.posterior.neighbours import JointSamples, neighbours
from session import Flag

_LAGS = 20
_ENOUGH = 40  # frames that a marker must be seen in
_OUTSIDE = 0.2  # share of the lags that may lie outside their 95 % band
_RATES = ("", ", up to the third harmonic")


@dataclass(frozen=True, eq=False)
class Whiteness:
    """Correlation of one trial's tracks beside a smooth swim, before and after the noise model: in time, over all
    markers, and between markers that are neighbours along the body, at one time.

    Attributes:
        trial: its name.
        lag_s: (l,) from one frame on.
        raw: (l,) of the residuals.
        modelled: (l,) of the residuals as the noise model says they should be.
        left: (l,) of what the model takes for independent (innovations).
        limit: within which 95 % of the lags of white noise lie.
        beside_raw: (2, m - 1) of the residuals of neighbours, from nose to fin: of all, and of what is no faster than
            the third harmonic of the beat, which a gait reads.
        beside_left: (2, m - 1) of what the model takes for independent of them.
        beside_limit: (2,) below which the root mean square of these lies in 99 % of trials with white noise.
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
    beside_raw: np.ndarray
    beside_left: np.ndarray
    beside_limit: np.ndarray
    frames: int
    effective: float
    white: float
    lasts_s: float
    sd_m: np.ndarray

    @property
    def outside(self) -> float:
        """Share of the lags that lie outside the limit."""
        return float((np.abs(self.left) > self.limit).mean())

    @property
    def beside(self) -> np.ndarray:
        """(2,) root mean square of the correlations that are left between neighbours."""
        return _rms(self.beside_left)

    @property
    def beside_before(self) -> np.ndarray:
        """(2,) the same of the residuals."""
        return _rms(self.beside_raw)

    @property
    def in_time(self) -> bool:
        """Whether no more lags lie outside the limit than a fifth of them."""
        return self.outside <= _OUTSIDE

    @property
    def across(self) -> bool:
        """Whether neighbours are left with no more correlation than chance gives."""
        return not (self.beside > self.beside_limit).any()

    @property
    def is_white(self) -> bool:
        """In time and across markers."""
        return self.in_time and self.across

    @property
    def fault(self) -> str:
        """What is left that should not be, in words; empty where the noise is white."""
        said = []
        if not self.in_time:
            said.append(
                f"{100 * self.outside:.0f} % of the lags lie outside the band of white noise, at most "
                f"{100 * _OUTSIDE:.0f} % may"
            )
        if not self.across:
            worst = int(np.argmax(self.beside / self.beside_limit))
            said.append(
                f"neighbouring markers correlate by {self.beside[worst]:.2f} (root mean square"
                f"{_RATES[worst]}), at most {self.beside_limit[worst]:.2f} is chance"
            )
        return " and ".join(said)


def noise_flags(found: Sequence[Whiteness]) -> list[Flag]:
    """One for each trial whose noise is not as the posterior takes it to be."""
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
    """Of one trial's tracks."""
    gait, noise = model.gait, model.noise
    position_m = model.trial.position_m[model.trial.kept]
    columns = smooth_swim(gait)
    lags = min(_LAGS, len(gait.time_s) // 4)
    seen = gait.usable.sum(axis=0) >= max(_ENOUGH, 2 * columns.shape[1])
    found = [
        _in_time(columns[usable], marker_m[usable], noise.correlation[np.ix_(usable, usable)], lags)
        for usable, marker_m in zip(gait.usable.T[seen], np.swapaxes(position_m, 0, 1)[seen], strict=True)
    ]
    raw, modelled, left = np.mean(found, axis=0) if found else np.full((3, lags), np.nan)
    along_m = model.twin.robot.marker_positions_m(model.trial.markers)[:, 0]
    order = np.array([m for m in np.argsort(along_m) if seen[m]], int)
    joint = JointSamples.of(columns, position_m, gait.usable, gait.time_s, noise, order)
    fastest_hz = HARMONICS * np.ptp(gait.turn_rad) / (2 * np.pi * np.ptp(gait.time_s))
    beside = neighbours(joint, gait.time_s[: len(joint.at)], fastest_hz)
    frame_s = float(np.median(np.diff(gait.time_s)))
    return Whiteness(
        trial=model.trial.name,
        lag_s=frame_s * np.arange(1, lags + 1),
        raw=raw,
        modelled=modelled,
        left=left,
        limit=1.96 / np.sqrt(max(2 * len(found), 1) * len(gait.time_s)),
        beside_raw=beside.raw,
        beside_left=beside.left,
        beside_limit=beside.limit,
        frames=len(gait.time_s),
        effective=noise.effective,
        white=noise.white,
        lasts_s=noise.lasts_s,
        sd_m=noise.sd_m,
    )


def _in_time(columns: np.ndarray, series: np.ndarray, correlation: np.ndarray, lags: int) -> np.ndarray:
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


def _rms(correlations: np.ndarray) -> np.ndarray:
    return np.asarray(np.sqrt((correlations**2).sum(axis=1) / max(correlations.shape[1], 1)))
