"""The roll of the hull, by which markers above its axis swing: a nuisance of the picture that all trials share."""

from typing import NamedTuple

import numpy as np

from swimmer import RobotSpec, Trajectories
from swimmer.effects.floating import NATURAL_ROLL_HZ, HullRoll, RollingHull
from swimmer.kinematics import MarkerKinematics

ROLL_SD = np.array([parameter.sd for parameter in HullRoll.parameters])
"""(2,) of the prior of each number, normal about 0."""
_LOW, _HIGH = np.array([(parameter.low, parameter.high) for parameter in HullRoll.parameters]).T
ROLL_STEP = 0.1
"""Of differences, in standard deviations."""


class Roll(NamedTuple):
    """Of a hull, as the effect `hull_roll` of the catalogue describes it.

    Attributes:
        per_sway: roll for each metre of sway far above the natural frequency, rad/m; 0 without a roll.
        natural: logarithm of the natural frequency over that of the catalogue.
    """

    per_sway: float = 0.0
    natural: float = 0.0

    @property
    def natural_hz(self) -> float:
        """The natural frequency."""
        return NATURAL_ROLL_HZ * float(np.exp(self.natural))

    @property
    def deviance(self) -> float:
        """Half its squared distance from no roll, in standard deviations."""
        return float(0.5 * ((np.array(self) / ROLL_SD) ** 2).sum())

    def moved(self, step: np.ndarray) -> "Roll":
        """By a step (2,) in standard deviations, within the bounds."""
        return Roll(*map(float, np.clip(np.array(self) + step * ROLL_SD, _LOW, _HIGH)))

    def shifted(self, number: int, sign: int) -> "Roll":
        """With one of its numbers off by `ROLL_STEP`."""
        off = np.zeros(2)
        off[number] = sign * ROLL_STEP
        return Roll(*map(float, np.array(self) + off * ROLL_SD))

    def seen(self, motion: Trajectories, robot: RobotSpec, markers: tuple[str, ...]) -> np.ndarray:
        """(s, n, m, 2) markers of simulated trajectories as they swing, m."""
        if not self.per_sway:
            return motion.marker_m
        hull = RollingHull.of(robot, markers)
        axes = MarkerKinematics(robot, markers).axes(motion.head, motion.hinges_rad)
        times = np.broadcast_to(motion.time_s, motion.marker_m.shape[:2])
        found = np.array(motion.marker_m)
        for row in np.flatnonzero(np.isfinite(motion.marker_m).all(axis=(1, 2, 3))):
            swung = hull.shift_m(times[row], motion.marker_m[row], axes[row], motion.crank_rad[row], self.natural_hz)
            found[row] += self.per_sway * swung
        return found


NO_ROLL = Roll()
