"""Swimmers of the second simulator with the face of `swimgym.Swimmers`: robots that were not the model of a policy."""

from collections.abc import Sequence

import numpy as np

from benchmarks.reality.integrate import step
from benchmarks.reality.layout import HINGES_PER_GAP, lay_out
from benchmarks.reality.motion import Motion
from benchmarks.reality.parameters import Parameters
from benchmarks.reality.run import STEP_S, start_of
from benchmarks.reality.tendons import Turn
from benchmarks.reality.world import Trial, World, prepared_parameters
from swimgym.swimmers import turned
from swimmer.robot import load_robot
from swimmer.twin import PLAUSIBLE_HINGE_RAD, PLAUSIBLE_SPEED_M_S

_LONG_S = 1e6  # no trial of them ends


class _Driven(Motion):
    """With cranks that turn from where they are at speeds of one's own."""

    def drive(self, time_s: np.ndarray, angle_rad: np.ndarray, speed_rad_s: np.ndarray) -> None:
        """From times (n, 1) on; angles and speeds (n, 1)."""
        self._speed, self._phase = speed_rad_s, angle_rad - speed_rad_s * time_s


class ReferenceSwimmers:
    """n swimmers, each a robot in its world; see `swimgym.Swimmers` for what its members are.

    Args:
        worlds: n, with their mechanisms.
        step_s: of the integrator.
    """

    interval_s = 0.02  # between two commands

    def __init__(self, worlds: Sequence[World], step_s: float = STEP_S) -> None:
        robot = load_robot()
        self._step_s, self.substeps = step_s, round(self.interval_s / step_s)
        self._layout, self.hinges = lay_out(robot), robot.hinges
        trial = Trial("swim", _LONG_S, 0.0, start_speed_m_s=0.0, run_in_s=0.0)
        made = [prepared_parameters(world, trial, self._layout, ("nose", "neck")) for world in worlds]
        count, still = len(worlds), np.zeros((len(worlds), 1))
        mechanisms = [world.mechanisms for world in worlds]
        self._motion = _Driven(self._layout, Parameters.stacked(made), still[:, 0], still[:, 0], mechanisms)
        position, velocity = start_of(self._motion, [trial] * count, still)
        position[:, 2:] -= 2 * np.pi  # a heading of pi and the robot's x tailwards make a yaw of 2 pi
        self._start = position, velocity
        self._states = self._motion.start_states(still, position, velocity)
        self._position, self._velocity = position.copy(), velocity.copy()
        self._time_s, self._turn = still.copy(), Turn(still.copy(), still.copy())
        layout = self._layout
        x = layout.origin_m + layout.moment_kg_m / layout.mass_kg
        self.centre_m = np.array([float(x @ layout.mass_kg / layout.mass_kg.sum()), 0.0])

    def __len__(self) -> int:
        return len(self._position)

    def rest(self, rows: np.ndarray, place_m: np.ndarray | float = 0.0, heading_rad: np.ndarray | float = 0.0) -> None:
        """Lays some swimmers (r,) still; what their mechanisms remember stays."""
        self._position[rows], self._velocity[rows] = (start[rows] for start in self._start)
        self._position[rows, 2:] += np.reshape(heading_rad, (-1, 1))
        self._position[rows, :2] = place_m - turned(self.centre_m, self._position[rows, 2])
        self._turn.angle_rad[rows] = self._turn.speed_rad_s[rows] = 0.0

    def drive(self, speed_rad_s: np.ndarray, rows: np.ndarray | None = None) -> None:
        """Advances all by one interval, cranks at speeds (n,); of some (r,) alone it keeps the outcome."""
        kept = np.setdiff1d(np.arange(len(self)), np.arange(len(self)) if rows is None else rows)
        before = self._position[kept].copy(), self._velocity[kept].copy()
        angle, speed = self._turn.angle_rad.copy(), np.reshape(speed_rad_s, (-1, 1)).astype(float)
        self._motion.drive(self._time_s, angle, speed)
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            for _ in range(self.substeps):
                self._position, self._velocity, at = step(
                    self._motion, self._time_s, self._position, self._velocity, self._states, self._step_s
                )
                self._states = self._motion.advanced(at, self._states, self._step_s)
                self._time_s = self._time_s + self._step_s
        lost = ~np.isfinite(self._position).all(axis=1)
        self._position[lost], self._velocity[lost] = np.nan, np.nan
        self._position[kept], self._velocity[kept] = before
        moved = angle + speed * self.interval_s
        moved[kept], speed[kept] = self._turn.angle_rad[kept], self._turn.speed_rad_s[kept]
        self._turn = Turn(moved, speed)

    @property
    def head(self) -> np.ndarray:
        """(n, 3) x, y (m) and yaw (rad)."""
        return self._position[:, :3]

    @property
    def head_rate(self) -> np.ndarray:
        """(n, 3) its rate."""
        return self._velocity[:, :3]

    @property
    def turn_rates(self) -> np.ndarray:
        """(n, 3) rates of roll, pitch and yaw, rad/s; the first two are 0."""
        return np.concatenate([np.zeros((len(self), 2)), self._velocity[:, 2:3]], axis=1)

    @property
    def crank(self) -> tuple[np.ndarray, np.ndarray]:
        """(n,) angle and (n,) speed of the crank as commanded, rad and rad/s."""
        return self._turn.angle_rad[:, 0], self._turn.speed_rad_s[:, 0]

    @property
    def tail(self) -> tuple[np.ndarray, np.ndarray]:
        """(n, h) angles of the robot's hinges and their rates, rad and rad/s."""
        angle, rate = self._position[:, 2::HINGES_PER_GAP], self._velocity[:, 2::HINGES_PER_GAP]
        return np.diff(angle, axis=1), np.diff(rate, axis=1)

    @property
    def centre(self) -> tuple[np.ndarray, np.ndarray]:
        """(n, 2) the steered point, m, and (n, 2) how it moves, m/s."""
        arm = turned(self.centre_m, self._position[:, 2])
        swept = np.stack([-arm[:, 1], arm[:, 0]], axis=1) * self._velocity[:, 2:3]
        return self._position[:, :2] + arm, self._velocity[:, :2] + swept

    @property
    def diverged(self) -> np.ndarray:
        """(n,) True where a swimmer is no longer physical."""
        with np.errstate(invalid="ignore"):
            sane = (np.abs(self.tail[0]) < PLAUSIBLE_HINGE_RAD).all(axis=1)
            sane &= (np.abs(self.head_rate[:, :2]) < PLAUSIBLE_SPEED_M_S).all(axis=1)
        return ~sane
