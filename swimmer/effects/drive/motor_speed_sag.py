"""A motor that is too weak for its load: slower than told, and slower still as it warms up."""

from dataclasses import dataclass

import numpy as np

from swimmer.effects.drive.even_turn import turn_of
from swimmer.effects.drive.warped_turn import WarpedTurn
from swimmer.effects.effect import Drive, Effect, Parameter

WARMING_S = 5.0
"""Time constant of the winding; over as long from the start the mean speed is the measured one."""
_MEAN = 1 - np.exp(-1.0)  # of exp(-t / WARMING_S) over that time


@dataclass(frozen=True)
class WarmingPace:
    """A pace that falls from 1 + (1 - mean) share towards 1 - mean share, with mean 1 over `WARMING_S`.

    Attributes:
        share: by how much it falls in the end.
    """

    share: float

    def reached_s(self, time_s: np.ndarray) -> np.ndarray:
        """(f,) s."""
        cooler_s = -WARMING_S * np.expm1(-time_s / WARMING_S) - _MEAN * time_s
        return np.asarray(time_s + self.share * cooler_s)

    def rate(self, time_s: np.ndarray) -> np.ndarray:
        """(f,)."""
        return np.asarray(1 + self.share * (np.exp(-time_s / WARMING_S) - _MEAN))


class MotorSpeedSag(Effect):
    """The share of speed that is lost grows with the load, which grows with the square of the speed."""

    name = "motor_speed_sag"
    family = "drive"
    stage = "drive"
    physics = "A DC motor at its voltage limit loses speed with its torque, and more as its winding warms up."
    source = (
        "Torque-speed line of a DC motor; drag grows with speed squared; copper gains 0.39 % resistance per kelvin."
    )
    seen_in = frozenset({"dry", "swim"})
    parameters = (Parameter("load", "s^2", 0.0, 0.3, 0.03), Parameter("warming", "1", 0.0, 0.3, 0.02))

    def turned_hz(self, commanded_hz: float, values: np.ndarray) -> float:
        """f / (1 + load f^2): the share `load` f^2 of what is left is lost."""
        return float(commanded_hz / (1 + values[0] * commanded_hz**2))

    def drive(self, drive: Drive, values: np.ndarray) -> Drive:
        """Slower and slower, with the same mean speed."""
        if values[1] == 0:
            return drive
        return drive._replace(turn=WarpedTurn(turn_of(drive), WarmingPace(float(values[1]))))


EFFECT = MotorSpeedSag()
