"""Posterior of the five coefficients: draws of the model whose mode is the fit, and when not to believe them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import xarray
from scipy.stats import chi2
from threadpoolctl import threadpool_limits

from fitting.coefficient_fit import NAMES, Marginal, is_no_drag
from fitting.model import Mode
from fitting.model.features import HARMONICS, SPEED, of_markers
from fitting.model.forecast import NORMAL_90
from fitting.posterior.quiet_arviz import arviz
from fitting.posterior.sampling import VARIABLES, Draws, Surrogate, fit_surrogate, sample
from fitting.progress import Progress, part_of
from session import Flag
from session.results import check_whole
from swimmer import FluidCoefficients
from swimmer.fluid import COEFFICIENT_BOUNDS

EFFECTIVE = 400
MISFIT_P = 0.01  # least probability with which noise and nuisances alone explain a misfit
_MARKERS_OFF_M = 0.005  # placement error of markers that is worth a flag
_DISCREPANT = 0.02  # relative error of the twin's wave that is worth a flag
_BESIDE = 0.1  # share of the draws that a 90 % interval leaves out
PRIOR = (
    f"uniform from {COEFFICIENT_BOUNDS[0]:g} to {COEFFICIENT_BOUNDS[1]:g} in each coefficient, lognormal in the "
    "twin's relative discrepancies of wave and speed; normal in the nuisances, the robot's hinges and crank arm among "
    "them, which are integrated out; other variance components as at the mode"
)
_TERMS = ("mean", *(f"{wave}_{h}" for h in range(1, HARMONICS + 1) for wave in ("cos", "sin")))


@dataclass(frozen=True, eq=False)
class Posterior:
    """Draws from the posterior of the coefficients and of the sizes of the twin's two discrepancies."""

    mode: Mode
    surrogate: Surrogate
    draws: Draws
    flags: tuple[Flag, ...] = ()

    @property
    def coefficients(self) -> np.ndarray:
        """Draws of the coefficients, (d, 5)."""
        return self.draws.flat[:, :5]

    @property
    def discrepancy(self) -> np.ndarray:
        """Draws of the relative discrepancies of wave and speed, (d, 2)."""
        return np.exp(self.draws.flat[:, 5:])

    @property
    def median(self) -> FluidCoefficients:
        """Median of each coefficient."""
        return FluidCoefficients(*map(float, np.median(self.coefficients, axis=0)))

    @property
    def marginals(self) -> dict[str, Marginal]:
        """Marginal posterior of each coefficient, by its name."""
        return {name: self._marginal(i) for i, name in enumerate(NAMES)}

    @cached_property
    def misfit_p(self) -> float:
        """Probability of features as far from the twin at the median by noise and nuisances alone."""
        likelihood = self.surrogate.likelihood
        off = likelihood.emulator(np.array([self.median]))[0] - likelihood.measured
        numbers = int(self.mode.model.observed.sum())
        return float(chi2.sf(off @ np.linalg.solve(likelihood.known, off), numbers - len(NAMES)))

    @property
    def outside(self) -> tuple[str, ...]:
        """Names of coefficients whose fit lies outside the 90 % interval.

        Where the fit is near a bound (nearer than half its own 90 % interval) the interval is one-sided: from that
        bound on.
        """
        reach = NORMAL_90 * np.sqrt(np.diag(self.mode.coefficient_covariance))
        low, high = COEFFICIENT_BOUNDS
        found = []
        for name, fit, draws, near in zip(NAMES, self.mode.coefficients, self.coefficients.T, reach, strict=True):
            below, above = float((draws < fit).mean()), float((draws > fit).mean())
            if fit - low < near:
                outside = above < _BESIDE
            elif high - fit < near:
                outside = below < _BESIDE
            else:
                outside = min(below, above) < _BESIDE / 2
            if outside:
                found.append(name)
        return tuple(found)

    def _marginal(self, i: int) -> Marginal:
        values = self.coefficients[:, i]
        low, high = map(float, np.quantile(values, [0.05, 0.95]))
        found = Marginal(
            mean=float(values.mean()),
            sd=float(values.std(ddof=1)),
            q05=low,
            q95=high,
            ess_bulk=float(self.draws.ess_bulk[i]),
            r_hat=float(self.draws.r_hat[i]),
            determined=False,
        )
        return found._replace(determined=found.narrow and not found.at_bounds)


def sample_posterior(
    mode: Mode,
    effective: int = EFFECTIVE,
    seed: int = 0,
    tell: Progress = lambda _message, _share: None,
) -> Posterior:
    """Sample the posterior of the coefficients given the trials of a mode.

    The prior is uniform over [0, 10] in each coefficient, for twins that swim forward from rest. Of the variance
    components those of the twin's wave share one factor and those of its speed another, which are drawn too; all others
    stay as large as at the mode.

    Args:
        mode: the fit.
        effective: number of effective draws.
        seed: seed of the draws.
        tell: takes messages with the share of the work that is done.
    """
    with threadpool_limits(1):  # the matrices are small: threads cost more than they save
        surrogate = fit_surrogate(mode, seed, part_of(tell, 0.0, 0.85))
        draws = sample(
            surrogate.likelihood, surrogate.prior, surrogate.walkers, effective, seed, part_of(tell, 0.85, 1.0)
        )
        found = Posterior(mode, surrogate, draws)
        return replace(found, flags=(*draws.flags, *_flags(found)))


def _flags(posterior: Posterior) -> list[Flag]:
    flags, surrogate = [], posterior.surrogate
    if not surrogate.settled:
        message = (
            f"the emulator still misses its likelihood by {surrogate.error:.1f} (standard deviation) after "
            f"{surrogate.simulations} simulations of each trial: intervals may be off"
        )
        flags.append(Flag("emulator_off", message=message))
    wave = float(np.median(posterior.discrepancy[:, 0]))
    if wave > _DISCREPANT:
        message = (
            f"the twin's wave is off by {100 * wave:.0f} % beyond noise and nuisances: the intervals allow for that, "
            "but another twin would have other coefficients"
        )
        flags.append(Flag("model_discrepancy", message=message))
    elif posterior.misfit_p < MISFIT_P:
        message = (
            "noise and known uncertainties do not explain how far the measured swims are from the twin "
            f"(p {_round_p(posterior.misfit_p)}): something that the twin lacks moves them, and coefficients may be "
            "off by more than their intervals"
        )
        flags.append(Flag("model_discrepancy", message=message))
    if (marker_m := posterior.mode.sizes["marker_placement"]) > _MARKERS_OFF_M:
        message = (
            f"markers sit some {1000 * marker_m:.0f} mm from where the robot's description has them, in all trials "
            "alike: measure their places; nose and neck set the scale, and with it every speed"
        )
        flags.append(Flag("markers_off", message=message))
    if names := posterior.outside:
        outside = ", ".join(names)
        message = f"the fit lies outside its own 90 % interval: {outside}; the mode is not typical of this posterior"
        flags.append(Flag("fit_outside", message=message))
    for name, marginal in posterior.marginals.items():
        interval = f"90 % interval {marginal.q05:.2g} to {marginal.q95:.2g}"
        if at := marginal.at_bounds:
            bounds = " and ".join(f"{bound:g}" for bound in at)
            message = f"{name} is at its bound {bounds}: the prior, not the trials, limits its {interval}"
            if all(is_no_drag(name, bound) for bound in at):
                message = f"{name} is at its physical limit 0: the trials allow that there is no such drag; {interval}"
            flags.append(Flag("at_bound", message=message))
        if not marginal.narrow:
            flags.append(Flag("unidentifiable", message=f"{name} is not determined: {interval}"))
    return flags


def _round_p(p_value: float) -> str:
    return "< 0.001" if p_value < 0.001 else f"= {p_value:.2g}"


def save_draws(path: Path, posterior: Posterior, stamp: Mapping[str, str | int]) -> None:
    """Write an ArviZ `InferenceData` as netCDF, with the groups posterior, sample_stats and observed_data.

    A walker of the ensemble is a chain. The logarithms of the relative discrepancies are variables as well.

    Args:
        path: the file.
        posterior: the posterior.
        stamp: attributes of the file.
    """
    data = arviz.InferenceData(
        attrs={**stamp, "prior": PRIOR},
        posterior=_chains(posterior.draws.chains),
        sample_stats=_statistics(posterior),
        observed_data=_observed_data(posterior),
    )
    data.to_netcdf(str(path), engine="h5netcdf")


def load_chains(path: Path) -> np.ndarray:
    """Read the chains (w, d, 7) that `save_draws` wrote: walkers, draws, coefficients and ln discrepancies.

    Raises:
        InputError: not there, or incomplete.
    """
    check_whole(path, "calib posterior")
    with xarray.open_dataset(path, group="posterior", engine="h5netcdf") as draws:
        return np.stack([draws[name].to_numpy() for name in VARIABLES], axis=-1)


def _chains(chains: np.ndarray) -> xarray.Dataset:
    places = {"chain": np.arange(chains.shape[0]), "draw": np.arange(chains.shape[1])}
    return xarray.Dataset({name: (("chain", "draw"), chains[..., i]) for i, name in enumerate(VARIABLES)}, places)


def _statistics(posterior: Posterior) -> xarray.Dataset:
    draws, surrogate = posterior.draws, posterior.surrogate
    scalars: dict[str, float | int] = {
        "acceptance_rate": draws.acceptance,
        "autocorrelation_steps": draws.autocorrelation,
        "steps": draws.steps,
        "simulations_of_each_trial": surrogate.simulations,
        **{f"{name}_sd": size for name, size in posterior.mode.sizes.items()},
        "emulator_error_ln_likelihood": surrogate.error,
        "misfit_p": posterior.misfit_p,
    }
    arrays = {"ess_bulk": ("variable", draws.ess_bulk), "r_hat": ("variable", draws.r_hat)}
    return xarray.Dataset({**scalars, **arrays}, {"variable": list(VARIABLES)})


def _observed_data(posterior: Posterior) -> xarray.Dataset:
    """Return the observed data of each trial: forward speed, and mean and harmonics of each marker along and across."""
    models = posterior.mode.model.trials
    features = np.array([model.measured for model in models])
    return xarray.Dataset(
        {
            "forward_speed_m_s": ("trial", features[:, SPEED]),
            "beat_m": (("trial", "marker", "axis", "term"), of_markers(features)),
            "frequency_hz": ("trial", np.array([model.trial.frequency.hz for model in models])),
            "noise_lasts_s": ("trial", np.array([model.noise.lasts_s for model in models])),
            "noise_sd_m": (("trial", "marker"), np.array([model.noise.sd_m for model in models])),
        },
        {
            "trial": [model.trial.name for model in models],
            "marker": list(models[0].trial.markers),
            "axis": ["along", "across"],
            "term": list(_TERMS),
        },
    )
