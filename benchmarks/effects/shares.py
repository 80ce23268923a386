"""Shares of sessions with their intervals, and how often probabilities come true."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np
from scipy.stats import binomtest

T = TypeVar("T")
_BINS = np.linspace(0.0, 1.0, 11)
_FEWEST, _DRAWS, _SEED = 5, 400, 0  # of an interval by resampling


class Share(NamedTuple):
    """How many of how many, with a 95 % interval (Wilson 1927)."""

    hits: int
    of: int

    @property
    def value(self) -> float:
        """nan of none."""
        return self.hits / self.of if self.of else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        """nan of none."""
        if not self.of:
            return float("nan"), float("nan")
        found = binomtest(self.hits, self.of).proportion_ci(0.95, method="wilson")
        return float(found.low), float(found.high)

    def to_json(self) -> dict[str, Any]:
        """Plain numbers."""
        return {"hits": self.hits, "of": self.of, "share": self.value, "ci95": self.interval}


class Estimate(NamedTuple):
    """A number with a 95 % interval; nan of nothing, an interval of nan where there is too little for one."""

    value: float
    interval: tuple[float, float]

    def times(self, factor: float) -> "Estimate":
        """In another unit."""
        low, high = self.interval
        return Estimate(factor * self.value, (factor * low, factor * high))

    def to_json(self) -> dict[str, Any]:
        """Plain numbers."""
        return {"value": self.value, "ci95": self.interval}


def median(values: Sequence[float]) -> Estimate:
    """Of a few numbers."""
    return resampled(values, lambda drawn: float(np.median(drawn)) if len(drawn) else float("nan"))


def resampled(of: Sequence[T], estimate: Callable[[Sequence[T]], float]) -> Estimate:
    """What is estimated, with the interval that drawing as many anew gives (percentiles; Efron 1979)."""
    value = estimate(of)
    if len(of) < _FEWEST or np.isnan(value):
        return Estimate(value, (float("nan"),) * 2)
    random = np.random.default_rng(_SEED)
    drawn = [estimate([of[i] for i in random.integers(len(of), size=len(of))]) for _ in range(_DRAWS)]
    low, high = np.nanquantile(drawn, [0.025, 0.975])
    return Estimate(value, (float(low), float(high)))


class Reliability(NamedTuple):
    """Probabilities against how often they came true.

    Attributes:
        told: mean probability in each bin that holds any.
        true: how many of how many came true there; Wilson's interval takes them for independent, which those of one
            session are not quite.
        error: mean difference between both, by number (expected calibration error; Naeini et al. 2015).
    """

    told: tuple[float, ...]
    true: tuple[Share, ...]
    error: float

    @classmethod
    def of(cls, told: np.ndarray, true: np.ndarray) -> "Reliability":
        """Of probabilities (k,) and whether each came true (k,)."""
        which = np.clip(np.digitize(told, _BINS) - 1, 0, len(_BINS) - 2)
        rows = [(told[which == b], true[which == b]) for b in sorted(set(which))]
        if not rows:
            return cls((), (), float("nan"))
        mean_told = tuple(float(p.mean()) for p, _ in rows)
        true_of = tuple(Share(int(t.sum()), len(t)) for _, t in rows)
        apart = np.abs(np.subtract(mean_told, [share.value for share in true_of]))
        return cls(mean_told, true_of, float(np.average(apart, weights=[share.of for share in true_of])))

    @classmethod
    def error_by_chance(cls, told: np.ndarray) -> Estimate:
        """The mean error of as many probabilities (k,) that come true just as often as they say; nan of none.

        The interval holds 95 % of such errors.
        """
        random = np.random.default_rng(_SEED)
        errors = [cls.of(told, random.uniform(size=len(told)) < told).error for _ in range(_DRAWS)]
        low, high = np.quantile(errors, [0.025, 0.975])
        return Estimate(float(np.mean(errors)), (float(low), float(high)))

    def to_json(self) -> list[dict[str, Any]]:
        """A bin each: what was told there, and how often it came true."""
        return [{"told": told} | true.to_json() for told, true in zip(self.told, self.true, strict=True)]
