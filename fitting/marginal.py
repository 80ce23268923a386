"""The marginal posterior of one coefficient."""

from typing import NamedTuple

from fitting.objective import COEFFICIENT_BOUNDS

_WIDE, _WIDE_BY = 2.5, 0.5  # ratio and difference of the ends of a 90 % interval beyond which nothing is determined
_NEAR_BOUND = 0.02  # of the range


class Marginal(NamedTuple):
    """The marginal posterior of one coefficient.

    Attributes:
        mean, sd: mean and standard deviation.
        q05, q95: ends of the 90 % interval.
        ess_bulk: effective number of draws.
        r_hat: convergence of the chains; 1 is best.
        determined: whether the trials determine it; one that is cut off at a bound is not, however narrow.
    """

    mean: float
    sd: float
    q05: float
    q95: float
    ess_bulk: float
    r_hat: float
    determined: bool

    @property
    def narrow(self) -> bool:
        """Whether the 90 % interval is narrow, by the trials or by a bound."""
        return self.q95 <= _WIDE * self.q05 or self.q95 - self.q05 <= _WIDE_BY

    @property
    def at_bounds(self) -> tuple[float, ...]:
        """The bounds of the prior that cut it off: its interval reaches them, and would reach further."""
        reach = _NEAR_BOUND * (COEFFICIENT_BOUNDS[1] - COEFFICIENT_BOUNDS[0])
        near = zip(COEFFICIENT_BOUNDS, (self.q05, self.q95), strict=True)
        return tuple(float(bound) for bound, end in near if abs(end - bound) < reach < self.sd)
