"""Turns of a crank that effects can work on: even ones, and ones made at another pace."""

from dataclasses import dataclass
from typing import Protocol

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


class Pace(Protocol):
    """How far along a turn the crank is by the clock."""

    def reached_s(self, time_s: np.ndarray) -> np.ndarray:
        """(f,) the instant of the turn that is reached at times (f,), s; 0 at 0."""
        ...

    def rate(self, time_s: np.ndarray) -> np.ndarray:
        """(f,) its derivative; 1 is the turn's own pace."""
        ...


@dataclass(frozen=True, eq=False)
class WarpedTurn:
    """Attributes: turn, as it would be made; pace, at which it is."""

    turn: Turn
    pace: Pace

    @property
    def logged(self) -> bool:
        """Whether the turn is that it is made of."""
        return self.turn.logged

    def angle(self, time_s: ArrayLike) -> np.ndarray:
        """(f,) rad."""
        return np.asarray(self.turn.angle(self.pace.reached_s(np.asarray(time_s, float))))

    def speed(self, time_s: ArrayLike) -> np.ndarray:
        """(f,) rad/s."""
        time_s = np.asarray(time_s, float)
        return np.asarray(self.turn.speed(self.pace.reached_s(time_s)) * self.pace.rate(time_s))
