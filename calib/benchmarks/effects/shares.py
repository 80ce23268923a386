"""Shares of sessions with their intervals, and how often probabilities come true."""

from typing import Any, NamedTuple

import numpy as np
from scipy.stats import binomtest

_BINS = np.linspace(0.0, 1.0, 11)


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
