"""The posterior of the five coefficients: how sure the trials make us, and when not to believe it."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fitting.coefficient_fit import NAMES
from fitting.objective import COEFFICIENT_BOUNDS
from fitting.posterior.exploration import Exploration
from fitting.posterior.sampling import Draws
from fitting.posterior.session_model import SessionModel
from fitting.posterior.whiteness import Whiteness
from session import Flag
from swimmer import FluidCoefficients

_WIDE, _WIDE_BY = 2.5, 0.5  # ratio and difference of the ends of a 90 % interval beyond which nothing is determined
_NEAR_BOUND = 0.02  # of the range


class Marginal(NamedTuple):
    """The posterior of one coefficient; determined is none that presses against a bound, however narrow it is there."""

    mean: float
    sd: float
    q05: float
    q95: float
    ess_bulk: float
    r_hat: float
    determined: bool

    @property
    def narrow(self) -> bool:
        """Whether the 90 % interval is, be it by the trials or by a bound."""
        return _narrow(self.q05, self.q95)

    @property
    def at_bounds(self) -> tuple[float, ...]:
        """The bounds of the prior that it presses against: its interval reaches them, and would reach further."""
        return _pressed(self.q05, self.q95, self.sd)


@dataclass(frozen=True, eq=False)
class Posterior:
    """Draws from the posterior of the coefficients and of the twin's own discrepancy.

    Attributes:
        model: the trials it rests on.
        found: the likelihood and how it was found.
        draws: from the posterior.
        misfit_p: how often gaits would lie as far from the twin at the posterior median if nothing but noise and
            nuisances stood between them.
        whiteness: of what the noise model leaves of each trial.
        flags: when not to believe it.
    """

    model: SessionModel
    found: Exploration
    draws: Draws
    misfit_p: float
    whiteness: tuple[Whiteness, ...]
    flags: tuple[Flag, ...]

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

    def _marginal(self, i: int) -> Marginal:
        values = self.coefficients[:, i]
        low, high = map(float, np.quantile(values, [0.05, 0.95]))
        sd = float(values.std(ddof=1))
        return Marginal(
            mean=float(values.mean()),
            sd=sd,
            q05=low,
            q95=high,
            ess_bulk=float(self.draws.ess_bulk[i]),
            r_hat=float(self.draws.r_hat[i]),
            determined=_narrow(low, high) and not _pressed(low, high, sd),
        )


def _narrow(low: float, high: float) -> bool:
    return high <= _WIDE * low or high - low <= _WIDE_BY


def _pressed(low: float, high: float, sd: float) -> tuple[float, ...]:
    reach = _NEAR_BOUND * (COEFFICIENT_BOUNDS[1] - COEFFICIENT_BOUNDS[0])
    near = zip(COEFFICIENT_BOUNDS, (low, high), strict=True)
    return tuple(float(bound) for bound, end in near if abs(end - bound) < reach < sd)
