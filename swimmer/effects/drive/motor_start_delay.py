"""A motor that starts after the trial has begun."""

from dataclasses import dataclass

import numpy as np

from swimmer.effects.drive.even_turn import turn_of
from swimmer.effects.drive.warped_turn import WarpedTurn
from swimmer.effects.effect import Drive, Effect, Parameter


@dataclass(frozen=True)
class LatePace:
    """At rest for three quarters of the delay, up to full speed over half of it, from then on late by all of it.

    Attributes:
        delay_s: more than 0.
    """

    delay_s: float

    def reached_s(self, time_s: np.ndarray) -> np.ndarray:
        """(f,) s."""
        u = self._started(time_s)
        return np.asarray(self.delay_s * u**3 * (1 - u / 2) / 2 + np.maximum(time_s - 1.25 * self.delay_s, 0.0))

    def rate(self, time_s: np.ndarray) -> np.ndarray:
        """(f,) from 0 to 1 by the smooth step 3 u^2 - 2 u^3."""
        u = self._started(time_s)
        return np.asarray(u**2 * (3 - 2 * u))

    def _started(self, time_s: np.ndarray) -> np.ndarray:
        return np.asarray(np.clip(2 * time_s / self.delay_s - 1.5, 0.0, 1.0))


class MotorStartDelay(Effect):
    """The crank rests at its phase for a while, then turns."""

    name = "motor_start_delay"
    family = "drive"
    stage = "drive"
    physics = "Between the first frame and the motor's start lie the host's and the bus's delay and the speed ramp."
    source = "Kinematics: a turn made later."
    seen_in = frozenset({"dry", "swim"})
    parameters = (Parameter("delay", "s", 0.0, 1.0, 0.05),)

    def drive(self, drive: Drive, values: np.ndarray) -> Drive:
        """The same turn, later."""
        if values[0] == 0:
            return drive
        return drive._replace(turn=WarpedTurn(turn_of(drive), LatePace(float(values[0]))))


EFFECT = MotorStartDelay()
