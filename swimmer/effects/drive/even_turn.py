"""A crank that turns evenly, as a turn that effects can work on."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from swimmer.crank_turn import Turn
from swimmer.effects.effect import Drive


@dataclass(frozen=True)
class EvenTurn:
    """Attributes: speed_rad_s, of the crank."""

    speed_rad_s: float
    logged: bool = False

    def angle(self, time_s: ArrayLike) -> np.ndarray:
        """(f,) rad."""
        return self.speed_rad_s * np.asarray(time_s, float)

    def speed(self, time_s: ArrayLike) -> np.ndarray:
        """(f,) rad/s."""
        return np.full(np.shape(time_s), self.speed_rad_s)


def turn_of(drive: Drive) -> Turn:
    """The turn that a crank makes, even or not."""
    return EvenTurn(2 * np.pi * drive.frequency_hz) if drive.turn is None else drive.turn
