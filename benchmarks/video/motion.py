"""Motion of the robot through a clip: a smooth function of time, from the twin or from a travelling wave."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from swimcal.mjcf import Scene
from swimcal.robot import Marker, RobotSpec
from swimcal.runs import MarkerKinematics, Runs
from swimcal.twin import Twin
from swimsynth.plan import PLAUSIBLE_COEFFICIENTS

WATER_LINE_M = 0.05
"""Height of the water in the robot's frame: where nose and neck are, whose distance gives the scale."""
_STEP_S = 1 / 240  # interval between samples
_MARGIN_S = 0.1  # The motion is known for this long before the first and after the last frame.
_TIMESTEP_S = 0.0015
# As in a synthetic session these make a developed swim, towards -x.
_RUN_IN_S = 8.0
_START_M_S = -0.15


class Pose(NamedTuple):
    """Poses of the chain."""

    head: np.ndarray  # (..., 3) x, y (m) and yaw (rad) of the head's frame in the pool
    hinges_rad: np.ndarray  # (..., h)


@dataclass(frozen=True, eq=False)
class Motion:
    """Poses of the robot, with a cubic spline between k samples."""

    time_s: np.ndarray  # (k,) increasing; the first frame is at 0
    head: np.ndarray  # (k, 3) x, y (m) and yaw (rad) of the head's frame in the pool
    hinges_rad: np.ndarray  # (k, h)

    def at(self, time_s: np.ndarray) -> Pose:
        """Return poses at times of any shape, s."""
        both = self._spline(time_s)
        return Pose(both[..., :3], both[..., 3:])

    def paced(self, factor: float) -> Motion:
        """Return the same motion, `factor` times as fast."""
        return replace(self, time_s=self.time_s / factor)

    def steadied(self, velocity_m_s: Sequence[float]) -> Motion:
        """Return the same motion with another mean velocity (x, y) and no mean turning, as if it swam in a current."""
        trend = np.polynomial.polynomial.polyfit(self.time_s, self.head, 1)  # (2, 3)
        steady = self.time_s[:, None] * ([*velocity_m_s, 0.0] - trend[1])
        return replace(self, head=self.head + steady)

    def moved(self, turn_rad: float, shift_m: Sequence[float]) -> Motion:
        """Return the motion turned about the pool's origin, counter-clockwise, then shifted by (x, y)."""
        cos, sin = np.cos(turn_rad), np.sin(turn_rad)
        place = self.head[:, :2] @ np.array([[cos, sin], [-sin, cos]]) + np.asarray(shift_m)
        return replace(self, head=np.column_stack([place, self.head[:, 2] + turn_rad]))

    @cached_property
    def _spline(self) -> CubicSpline:
        return CubicSpline(self.time_s, np.hstack([self.head, self.hinges_rad]))


class RobotPoints:
    """Points fixed to the links of a robot, from its pose to places in the pool.

    Args:
        robot: robot that carries the points.
        points: the k points: the link that carries each, and its place on the straight robot (robot frame, m).
    """

    def __init__(self, robot: RobotSpec, points: Sequence[Marker]) -> None:
        named = {f"point_{i}": point for i, point in enumerate(points)}
        self._kinematics = MarkerKinematics(robot.model_copy(update={"markers": named}), tuple(named))
        self.height_m = np.array([point.position_m[2] for point in points]) - WATER_LINE_M  # (k,)

    def __call__(self, pose: Pose) -> np.ndarray:
        """Return the (..., k, 3) places in the pool, z from the water, m."""
        flat = self._kinematics(*pose)
        return np.concatenate([flat, np.broadcast_to(self.height_m[:, None], (*flat.shape[:-1], 1))], axis=-1)


def twin_motion(robot: RobotSpec, frequency_hz: float, seconds: float) -> Motion:
    """Simulate a developed swim of the twin with plausible coefficients, towards -x from about the origin.

    Args:
        robot: robot that swims.
        frequency_hz: turns of the crank a second.
        seconds: time from the first frame to the last.

    Raises:
        swimcal.errors.SimulationDiverged: the motion is unstable.
    """
    time_s = np.arange(-_MARGIN_S, seconds + _MARGIN_S + _STEP_S, _STEP_S)
    runs = Runs(
        coefficients=np.array([PLAUSIBLE_COEFFICIENTS], float),
        frequency_hz=np.array([frequency_hz]),
        phase_rad=np.array([-2 * np.pi * frequency_hz * _RUN_IN_S]),
        velocity=np.array([[_START_M_S, 0.0, 0.0]]),
    )
    seen = Twin(robot, scene=Scene(timestep_s=_TIMESTEP_S)).simulate(runs, _RUN_IN_S + time_s)
    head = seen.head[0] - [*seen.head[0, 0, :2], 0.0]
    return Motion(time_s, head, seen.hinges_rad[0])
