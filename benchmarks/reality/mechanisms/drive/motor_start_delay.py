"""A motor that starts after the trial has begun."""

from dataclasses import dataclass

import numpy as np

from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength
from benchmarks.reality.tendons import Turn

_TYPICAL_S = 0.05
_STOPS_S = 0.1


@dataclass(frozen=True)
class MotorStartDelay(Mechanism):
    """From the first frame the crank rests for a while, then spins up to its speed as a first-order lag.

    In the run-in it turns as told and comes to rest just at the first frame, at the angle that it is told for then.

    Attributes:
        rest_s: for which it does not move.
        spin_up_s: time constant; in the end it is late by the sum of both.
    """

    rest_s: float
    spin_up_s: float

    def turn(self, time_s: np.ndarray, turn: Turn, state: np.ndarray) -> Turn:  # noqa: ARG002
        """Late by t - reached(t)."""
        stops_s = np.minimum(self.rest_s + self.spin_up_s, _STOPS_S)
        before, after = np.minimum(time_s, 0.0), np.maximum(time_s - self.rest_s, 0.0)
        fading, begun = np.exp(before / stops_s), np.exp(-after / self.spin_up_s)
        reached = np.where(time_s < 0, before * (1 - fading), after - self.spin_up_s * (1 - begun))
        pace = np.where(time_s < 0, 1 - fading * (1 + before / stops_s), 1 - begun)
        return Turn(turn.angle_rad - turn.speed_rad_s * (time_s - reached), turn.speed_rad_s * pace)


def drawn(random: np.random.Generator) -> AtStrength:
    """Draws how much of the delay is rest and how much is spin-up."""
    rest = random.uniform(0.3, 0.7)

    def at(strength: float) -> tuple[Mechanism, ...]:
        if strength == 0:
            return ()
        delay_s = _TYPICAL_S * strength
        return (MotorStartDelay(float(rest * delay_s), float((1 - rest) * delay_s)),)

    return at
