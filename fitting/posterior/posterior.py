"""The posterior of the five coefficients: how sure the trials make us, and when not to believe it."""

from dataclasses import dataclass

import numpy as np

from fitting.coefficient_fit import NAMES
from fitting.marginal import Marginal
from fitting.model.session_model import SessionModel
from fitting.posterior.exploration import Exploration
from fitting.posterior.sampling import Draws
from fitting.posterior.whiteness import Whiteness
from session import Flag
from swimmer import FluidCoefficients


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
