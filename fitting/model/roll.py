"""The roll of the hull, by which markers above its axis swing: a nuisance of the picture that all trials share."""

from typing import NamedTuple

import numpy as np

from swimmer import RobotSpec, Trajectories
from swimmer.effects.floating import NATURAL_ROLL_HZ, HullRoll, RollingHull
from swimmer.kinematics import MarkerKinematics

ROLL_SD = np.array([parameter.sd for parameter in HullRoll.parameters])
"""Prior standard deviation of each number, (2,), normal about 0."""
_LOW = np.array([parameter.low for parameter in HullRoll.parameters])
_HIGH = np.array([parameter.high for parameter in HullRoll.parameters])
ROLL_STEP = 0.1
"""Step of finite differences, in standard deviations."""


class Roll(NamedTuple):
    """Roll of a hull, as the effect `hull_roll` of the catalogue describes it.

    Attributes:
        per_sway: roll for each metre of sway far above the natural frequency, rad/m; 0 without a roll.
        natural: logarithm of the natural frequency over that of the catalogue.
    """

    per_sway: float = 0.0
    natural: float = 0.0

    @property
    def natural_hz(self) -> float:
        """Natural frequency of the roll, Hz."""
        return NATURAL_ROLL_HZ * float(np.exp(self.natural))

    @property
    def deviance(self) -> float:
        """Half its squared distance from no roll, in standard deviations."""
        return float(0.5 * ((np.array(self) / ROLL_SD) ** 2).sum())

    def moved(self, step: np.ndarray) -> "Roll":
        """Return the roll moved by a step (2,) in standard deviations, within the bounds."""
        return Roll(*map(float, np.clip(np.array(self) + step * ROLL_SD, _LOW, _HIGH)))

    def shifted(self, number: int, sign: int) -> "Roll":
        """Return the roll with one of its numbers off by `ROLL_STEP`."""
        off = np.zeros(2)
        off[number] = sign * ROLL_STEP
        return Roll(*map(float, np.array(self) + off * ROLL_SD))

    def seen(self, motion: Trajectories, robot: RobotSpec, markers: tuple[str, ...]) -> np.ndarray:
        """Return the markers (s, n, m, 2) of simulated trajectories as they swing, m.

        Args:
            motion: the trajectories.
            robot: the robot.
            markers: names of the m markers.
        """
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
