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
        true: how often it came true there.
        number: how many were told there.
        error: mean difference between both, by number (expected calibration error; Naeini et al. 2015).
    """

    told: tuple[float, ...]
    true: tuple[float, ...]
    number: tuple[int, ...]
    error: float

    @classmethod
    def of(cls, told: np.ndarray, true: np.ndarray) -> "Reliability":
        """Of probabilities (k,) and whether each came true (k,)."""
        which = np.clip(np.digitize(told, _BINS) - 1, 0, len(_BINS) - 2)
        rows = [(told[which == b], true[which == b]) for b in sorted(set(which))]
        means = [(float(p.mean()), float(t.mean()), len(p)) for p, t in rows]
        if not means:
            return cls((), (), (), float("nan"))
        mean_told, mean_true, number = zip(*means, strict=True)
        error = float(np.average(np.abs(np.subtract(mean_told, mean_true)), weights=number))
        return cls(mean_told, mean_true, number, error)

    @classmethod
    def error_by_chance(cls, told: np.ndarray) -> float:
        """The mean error of as many probabilities (k,) that come true just as often as they say; nan of none."""
        random = np.random.default_rng(_SEED)
        return float(np.mean([cls.of(told, random.uniform(size=len(told)) < told).error for _ in range(_DRAWS)]))
