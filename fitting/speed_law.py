"""The law of the speed: the power of the beat frequency with which trials swim, and with which the twin does."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.stats import t as student

from fitting.trial import MeasuredTrial

LEVEL = 0.9
_FEWEST = 3  # trials that tell a slope with its interval


class Slope(NamedTuple):
    """Slope of a straight line through points, by least squares, with Student's 90 % interval; None for two points."""

    value: float
    interval: tuple[float, float] | None

    @property
    def differs_from_zero(self) -> bool:
        """Whether the interval leaves out 0."""
        return self.interval is not None and (self.interval[0] > 0 or self.interval[1] < 0)


@dataclass(frozen=True)
class SpeedLaw:
    """Law of the speed over all swim trials of a session, fitted and held out.

    Attributes:
        exponents: exponent of the speed over the frequency, by "measured" and the names of models.
        residual: slope of ln(measured speed / twin's) with ln frequency: 0 where the twin has the right law.
    """

    exponents: Mapping[str, Slope]
    residual: Slope | None

    @property
    def sentence(self) -> str:
        """Sentence on the twin's law of the speed."""
        if self.residual is None or self.residual.interval is None:
            return "Fewer than three trials swim forward: they say nothing of the law of the speed."
        if not self.residual.differs_from_zero:
            return "The twin's speed grows with the frequency as the measured one, within the scatter of the trials."
        if self.residual.value > 0:
            return (
                "The measured speed grows more steeply with the frequency than the twin's. Possible causes: drag that "
                "grows less than with the squared speed (skin friction, a cable in tow), or a loss of thrust at slow "
                "beats."
            )
        return (
            "The measured speed grows less with the frequency than the twin's. Possible causes: drag that grows more "
            "than with the squared speed (waves), or a tail that yields or a motor that slows down at fast beats."
        )


def speed_law(trials: Sequence[MeasuredTrial], models: Mapping[str, Sequence[float]]) -> SpeedLaw | None:
    """Fit the law of some trials; None where fewer than two of different frequencies swim forward.

    Args:
        trials: the trials.
        models: speed of each trial by each model, m/s, by the model's name.
    """
    forward = np.array([trial.speed > 0 for trial in trials], bool)
    swims = [trial for trial, swam in zip(trials, forward, strict=True) if swam]
    hz = np.array([trial.frequency.hz for trial in swims])
    if len(swims) < 2 or np.ptp(hz) == 0:
        return None
    speed, ln_hz = np.array([trial.speed for trial in swims]), np.log(hz)
    found = {name: np.array(each, float)[forward] for name, each in models.items()}
    found = {name: each for name, each in found.items() if (each > 0).all()}
    exponents = {"measured": slope(ln_hz, np.log(speed))}
    exponents |= {name: slope(ln_hz, np.log(each)) for name, each in found.items()}
    residual = np.log(speed / found["twin"]) if "twin" in found else None
    return SpeedLaw(exponents, None if residual is None else slope(ln_hz, residual))


def slope(x: np.ndarray, y: np.ndarray) -> Slope:
    """Return the slope of y (n,) over x (n,), at least two points."""
    off = x - x.mean()
    value = float(off @ y / (off @ off))
    if len(x) < _FEWEST:
        return Slope(value, None)
    residual = y - y.mean() - value * off
    freedom = len(x) - 2
    reach = float(student.ppf(0.5 + LEVEL / 2, freedom) * np.sqrt(residual @ residual / freedom / (off @ off)))
    return Slope(value, (value - reach, value + reach))
