"""A crank that turns faster or slower than it is told."""

import numpy as np

from swimmer.effects.effect import Effect, Parameter


class DriveRatioError(Effect):
    """The crank turns at (1 + relative) times the command; the turn itself is even, and known by its frequency."""

    name = "drive_ratio_error"
    family = "drive"
    stage = "drive"
    physics = "A gear ratio, pulley or speed unit that differs from the described one scales every speed alike."
    source = "Kinematics of gearing; the unit of an XW540's goal speed is 0.229 turns a minute."
    seen_in = frozenset({"dry", "swim"})
    parameters = (Parameter("relative", "1", -0.4, 0.4, 0.02),)

    def turned_hz(self, commanded_hz: float, values: np.ndarray) -> float:
        """At the wrong ratio."""
        return float(commanded_hz * (1 + values[0]))


EFFECT = DriveRatioError()
