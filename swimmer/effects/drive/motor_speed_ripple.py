"""A motor whose speed goes up and down within a turn."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from swimmer.crank_turn import Turn
from swimmer.effects.drive.even_turn import turn_of
from swimmer.effects.effect import Drive, Effect, Parameter


@dataclass(frozen=True, eq=False)
class RippledTurn:
    """A turn whose speed is modulated twice in every turn of the crank: each tendon pulls once.

    Attributes:
        turn: without the ripple.
        phase_rad: of the crank at time 0.
        cosine, sine: relative amplitudes of the speed.
    """

    turn: Turn
    phase_rad: float
    cosine: float
    sine: float

    @property
    def logged(self) -> bool:
        """Whether the turn is that it is made of."""
        return self.turn.logged

    def angle(self, time_s: ArrayLike) -> np.ndarray:
        """(f,) rad."""
        even = self.turn.angle(time_s)
        return np.asarray(even + self._ahead(even) - self._ahead(np.zeros(1))[0])

    def speed(self, time_s: ArrayLike) -> np.ndarray:
        """(f,) rad/s."""
        twice = 2 * (self.turn.angle(time_s) + self.phase_rad)
        return np.asarray(self.turn.speed(time_s) * (1 + self.cosine * np.cos(twice) + self.sine * np.sin(twice)))

    def _ahead(self, even: np.ndarray) -> np.ndarray:
        twice = 2 * (even + self.phase_rad)
        return np.asarray((self.cosine * np.sin(twice) - self.sine * np.cos(twice)) / 2)


class MotorSpeedRipple(Effect):
    """The crank slows down where the tendons pull hardest, and hurries in between.

    By as many turns a second at any speed, since most of the pull is that of the hinges' springs.
    """

    name = "motor_speed_ripple"
    family = "drive"
    stage = "drive"
    physics = "Under a load that comes twice a turn a speed-controlled motor turns unevenly, by load over gain."
    source = "First order response of a proportional speed loop to a periodic load."
    seen_in = frozenset({"dry", "swim"})
    parameters = (Parameter("cosine", "Hz", -0.3, 0.3, 0.05), Parameter("sine", "Hz", -0.3, 0.3, 0.05))

    def drive(self, drive: Drive, values: np.ndarray) -> Drive:
        """With the ripple."""
        if not values.any():
            return drive
        cosine, sine = map(float, values / drive.frequency_hz)
        return drive._replace(turn=RippledTurn(turn_of(drive), drive.phase_rad, cosine, sine))


EFFECT = MotorSpeedRipple()
