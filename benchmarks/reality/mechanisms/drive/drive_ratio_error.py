"""A crank that turns faster or slower than it is told, by a wheel of another size."""

from dataclasses import dataclass

import numpy as np

from benchmarks.reality.instant import Instant
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength
from benchmarks.reality.tendons import Turn

_TYPICAL = 0.02


@dataclass(frozen=True)
class DriveRatioError(Mechanism):
    """Since the start of the run-in the crank turns (1 + relative) times as far as told.

    The wheel that is wrong also runs out of true: angles e ahead of and behind the mean, once a turn.

    Attributes:
        relative: error of the ratio.
        runout_rad: e.
    """

    relative: float
    runout_rad: float

    def start(self, now: Instant) -> np.ndarray:
        """(n, 1) the angle from which the crank starts, rad."""
        return now.turn.angle_rad

    def turn(self, time_s: np.ndarray, turn: Turn, state: np.ndarray) -> Turn:  # noqa: ARG002
        """Further."""
        turned = (1 + self.relative) * (turn.angle_rad - state)
        ahead, rate = self.runout_rad * np.sin(turned), 1 + self.runout_rad * np.cos(turned)
        return Turn(state + turned + ahead, (1 + self.relative) * turn.speed_rad_s * rate)


def drawn(random: np.random.Generator) -> AtStrength:
    """Draws faster or slower, and how far the wheel runs out of true."""
    sign, runout = random.choice([-1.0, 1.0]), random.uniform(0.0, 0.1)

    def at(strength: float) -> tuple[Mechanism, ...]:
        if strength == 0:
            return ()
        relative = _TYPICAL * strength
        return (DriveRatioError(float(sign * relative), float(runout * relative)),)

    return at
