"""Posterior of the coefficients, its draws on disk, and what the trials determine of the coefficients and of the robot.

`sample_posterior` draws, `save_draws` writes the draws for ArviZ. `identifiability` tells which coefficients, and which
combinations of them, the trials determine; `robot_parts` how far they ask the robot's own numbers to move.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray
from scipy.stats import chi2
from threadpoolctl import threadpool_limits

from fitting.coefficient_fit import NAMES, Marginal, is_no_drag
from fitting.features import SPEED, marker_part
from fitting.forecast import NORMAL_90
from fitting.mode import Mode
from fitting.posterior.sampling import VARIABLES, Draws, Surrogate, arviz, as_dataset, fit_surrogate, sample
from fitting.progress import Progress, part_of
from fitting.trial import HARMONICS
from swimcal.flags import Flag
from swimcal.mjcf import COEFFICIENT_BOUNDS, FluidCoefficients
from swimcal.results import check_whole

# The posterior
EFFECTIVE = 400  # number of effective draws that a posterior takes by default
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

# What the trials determine
_WORTH_NAMING = 0.25  # least part of a direction that is named
_ASKED_SD = 2.0  # error of the robot, in standard deviations, that is worth a flag


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
        surrogate = fit_surrogate(mode, seed, part_of(tell, 0.0, 0.9))
        draws = sample(
            surrogate.likelihood, surrogate.prior, surrogate.walkers, effective, seed, part_of(tell, 0.9, 1.0)
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
        p_value = "< 0.001" if posterior.misfit_p < 0.001 else f"= {posterior.misfit_p:.2g}"
        message = (
            "noise and known uncertainties do not explain how far the measured swims are from the twin "
            f"(p {p_value}): something that the twin lacks moves them, and coefficients may be "
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


# The draws on disk.


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
        posterior=as_dataset(posterior.draws.chains),
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
            "beat_m": (("trial", "marker", "axis", "term"), marker_part(features)),
            "noise_lasts_s": ("trial", np.array([model.noise.lasts_s for model in models])),
            "noise_sd_m": (("trial", "marker"), np.array([model.noise.sd_m for model in models])),
        },
        {
            "trial": [model.trial.name for model in models],
            "frequency_hz": ("trial", np.array([model.trial.frequency.hz for model in models])),
            "marker": list(models[0].trial.markers),
            "axis": ["along", "across"],
            "term": list(_TERMS),
        },
    )


# What the trials determine.


@dataclass(frozen=True, eq=False)
class Identifiability:
    """Identifiability of the coefficients and of their combinations.

    Attributes:
        determined: (5,) whether each coefficient is determined; none is that presses against a bound.
        at_bound: (5,) whether its posterior would be narrow enough but is at a bound of the prior.
        narrowed: (5,) standard deviation over that of the prior.
        correlation: (5, 5).
        directions: (5, 5) unit vectors of combinations, the best determined first; the prior is the same in all.
        direction_narrowed: (5,) standard deviation along each over that of the prior.
    """

    determined: np.ndarray
    at_bound: np.ndarray
    narrowed: np.ndarray
    correlation: np.ndarray
    directions: np.ndarray
    direction_narrowed: np.ndarray

    @property
    def sentence(self) -> str:
        """Sentences on what is determined, what is not, and what only the prior's bound limits."""
        pressed = self._name(self.at_bound)
        against = [f"{_verb(pressed, 'presses', 'press')} against a bound of the prior."] if pressed else []
        sentences = [self._sentence_on_determined, *against]
        return " ".join(sentence[0].upper() + sentence[1:] for sentence in sentences)

    @property
    def _sentence_on_determined(self) -> str:
        held, loose = self._name(self.determined), self._name(~self.determined & ~self.at_bound)
        if len(held) == len(NAMES):
            return "All five coefficients are determined by these trials."
        if not held:
            return "None of the five coefficients is determined by these trials."
        if not loose:
            return f"{_verb(held, 'is', 'are')} determined by these trials."
        return f"{_verb(loose, 'is', 'are')} not determined by these trials; {_verb(held, 'is', 'are')}."

    def _name(self, chosen: np.ndarray) -> list[str]:
        return [name.replace("_", " ") for name, yes in zip(NAMES, chosen, strict=True) if yes]

    def combination(self, row: int) -> str:
        """Return a direction in words, its large parts first: `0.9 magnus lift − 0.4 kutta lift`."""
        parts = self.directions[row]
        named = [i for i in np.argsort(-np.abs(parts)) if abs(parts[i]) >= _WORTH_NAMING]
        first = np.sign(parts[named[0]])
        words = [f"{abs(parts[i]):.2g} {NAMES[i].replace('_', ' ')}" for i in named]
        signs = ["+" if parts[i] * first > 0 else "−" for i in named]
        return " ".join([words[0], *(f"{sign} {word}" for sign, word in zip(signs[1:], words[1:], strict=True))])


def identifiability(posterior: Posterior) -> Identifiability:
    """Compute what the draws of a posterior determine."""
    low, high = COEFFICIENT_BOUNDS
    prior = (high - low) ** 2 / 12  # variance of the uniform prior, the same for all
    covariance = np.cov(posterior.coefficients.T)
    spread = np.sqrt(np.diag(covariance))
    shares, directions = np.linalg.eigh(covariance / prior)
    return Identifiability(
        determined=np.array([marginal.determined for marginal in posterior.marginals.values()]),
        at_bound=np.array([m.narrow and bool(m.at_bounds) for m in posterior.marginals.values()]),
        narrowed=spread / np.sqrt(prior),
        correlation=covariance / np.outer(spread, spread),
        directions=directions.T,
        direction_narrowed=np.sqrt(np.maximum(shares, 0.0)),
    )


def _verb(names: list[str], one: str, several: str) -> str:
    listed = " and ".join([", ".join(names[:-1]), names[-1]]) if len(names) > 1 else names[0]
    return f"{listed} {one if len(names) == 1 else several}"


class RobotPart(NamedTuple):
    """Relative error that a number of the twin may have against the robot.

    Attributes:
        quantity: "hinge_stiffness", "hinge_damping" or "crank_arm".
        measured: whether dry experiments gave it.
        sd: standard deviation of its error before the swim trials are looked at.
        mean_after, sd_after: mean and standard deviation of its error with the swim trials.
    """

    quantity: str
    measured: bool
    sd: float
    mean_after: float
    sd_after: float


def robot_parts(posterior: Posterior) -> tuple[RobotPart, ...]:
    """Return the robot's uncertain numbers before and after the trials.

    Given coefficients they are a normal nuisance, here averaged over all draws of these.
    """
    mode = posterior.mode
    columns = np.vstack([block.sensitivities.robot for block in mode.blocks])  # (k, q)
    gain = np.linalg.solve(mode.total, columns)
    means = (mode.model.measured - posterior.surrogate.likelihood.emulator(posterior.coefficients)) @ gain  # (d, q)
    variance = 1 - (gain * columns).sum(axis=0) + means.var(axis=0)
    doubts = [each.doubt for each in mode.model.trials[0].doubted]
    return tuple(
        RobotPart(doubt.source.quantity, not doubt.source.assumed, doubt.sd, doubt.sd * float(m), doubt.sd * float(s))
        for doubt, m, s in zip(doubts, means.mean(axis=0), np.sqrt(variance), strict=True)
    )


def robot_flags(parts: tuple[RobotPart, ...]) -> list[Flag]:
    """Flag each number of the robot that the trials ask to be far from what it is taken to be."""
    return [
        Flag(
            "robot_off",
            message=f"the trials ask for a {part.quantity.replace('_', ' ')} {100 * part.mean_after:+.2g} % off, more "
            f"than twice the {100 * part.sd:.2g} % to which it is known: measure it; coefficients may be off with it",
        )
        for part in parts
        if abs(part.mean_after) > _ASKED_SD * part.sd
    ]
