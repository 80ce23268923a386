"""The posterior of the five coefficients: draws of the model whose mode is the fit, and when not to believe them."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.stats import chi2
from threadpoolctl import threadpool_limits

from fitting.coefficient_fit import NAMES
from fitting.marginal import Marginal
from fitting.model import Mode
from fitting.model.forecast import NORMAL_90
from fitting.model.mode import Progress
from fitting.objective import COEFFICIENT_BOUNDS
from fitting.posterior.sampling import Draws, sample
from fitting.posterior.surrogate import Surrogate, fit_surrogate
from session import Flag
from swimmer import FluidCoefficients

EFFECTIVE = 400
MISFIT_P = 0.01  # below which noise and nuisances alone do not explain a misfit
_MARKERS_OFF_M = 0.005  # from which where markers sit is worth a flag
_DISCREPANT = 0.02  # relative, from which the error of the twin's wave is worth a flag
_BESIDE = 0.1  # share of the draws that a 90 % interval leaves out


@dataclass(frozen=True, eq=False)
class Posterior:
    """Draws from the posterior of the coefficients and of the sizes of the twin's two discrepancies.

    Attributes:
        mode: that it is about.
        surrogate: of the twin.
        draws: from the posterior.
        flags: when not to believe it.
    """

    mode: Mode
    surrogate: Surrogate
    draws: Draws
    flags: tuple[Flag, ...] = ()

    @property
    def coefficients(self) -> np.ndarray:
        """(d, 5) draws."""
        return self.draws.flat[:, :5]

    @property
    def discrepancy(self) -> np.ndarray:
        """(d, 2) draws of the relative discrepancies of wave and speed."""
        return np.exp(self.draws.flat[:, 5:])

    @property
    def median(self) -> FluidCoefficients:
        """Of each coefficient."""
        return FluidCoefficients(*map(float, np.median(self.coefficients, axis=0)))

    @property
    def marginals(self) -> dict[str, Marginal]:
        """By the coefficient's name."""
        return {name: self._marginal(i) for i, name in enumerate(NAMES)}

    @cached_property
    def misfit_p(self) -> float:
        """How often features lie as far from the twin at the median if noise and nuisances alone stand between them."""
        likelihood = self.surrogate.likelihood
        off = likelihood.emulator(np.array([self.median]))[0] - likelihood.measured
        return float(chi2.sf(off @ np.linalg.solve(likelihood.known, off), len(off) - len(NAMES)))

    @property
    def outside(self) -> tuple[str, ...]:
        """Names of coefficients whose fit lies outside the 90 % interval.

        Where the fit is near a bound (nearer than half its own 90 % interval) the interval is one-sided: from
        that bound on.
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
    """Draws from the posterior of the coefficients given the trials of a mode.

    The prior is uniform over [0, 10] in each coefficient, for twins that swim forward from rest. Of the variance
    components those of the twin's wave share one factor and those of its speed another, which are drawn too; all others
    stay as large as at the mode.

    Args:
        mode: the likeliest coefficients, and the covariance of all else.
        effective: draws wanted for every coefficient.
        seed: of all draws.
        tell: of the progress.
    """
    with threadpool_limits(1):  # the matrices are small: threads cost more than they save
        surrogate = fit_surrogate(mode, seed, tell)
        draws = sample(surrogate.likelihood, surrogate.prior, surrogate.walkers, effective, seed, tell)
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
            f"noise and nuisances alone hardly put features as far from the twin (p {posterior.misfit_p:.2g}): "
            "something that the twin leaves out moves them, and coefficients may be off by more than their intervals"
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
            flags.append(Flag("at_bound", message=message))
        if not marginal.narrow:
            flags.append(Flag("unidentifiable", message=f"{name} is not determined: {interval}"))
    return flags
