"""Tendons that hang loose before they pull."""

from collections.abc import Callable, Sequence

import mujoco
import numpy as np

from swimmer.effects.effect import Effect, Parameter, StepState
from swimmer.effects.step_damping import StepDamping
from swimmer.effects.tendons.path import TendonPath, rest_lengths, set_rest_lengths
from swimmer.mjcf import Scene
from swimmer.robot import RobotSpec

_EDGE_M = 1e-4  # over which a tendon's damper comes in before its spring does


class LooseTendons:
    """Takes the damping from tendons while they hang loose.

    The plain twin's dampers stand beside its springs and are strong for the sake of the time step: they would drag the
    tail along through the whole dead band.

    Args:
        robot: the robot.
        models: of the n simulations.
    """

    def __init__(self, robot: RobotSpec, models: Sequence[mujoco.MjModel]) -> None:
        radius = np.array([model.site("anchor_right").pos[2] for model in models])
        self._path = TendonPath(robot, radius)
        self._rest = np.array([model.tendon_lengthspring for model in models])  # (n, 2, 2)
        self._damping = np.array([model.tendon_damping for model in models])  # (n, 2)
        self._half_step_s = models[0].opt.timestep / 2
        self._crank = -len(robot.hinges) - 1

    def __call__(self, state: StepState) -> StepDamping:
        """For the next step, by the lengths in its middle."""
        middle = (state.position + self._half_step_s * state.velocity)[:, self._crank :]
        length = self._path(middle[:, 0], middle[:, 1:]).length_m.sum(axis=-1)
        beyond = np.maximum(self._rest[..., 0] - length, length - self._rest[..., 1])
        loose = np.where(self._rest[..., 0] < self._rest[..., 1], np.clip(-beyond / _EDGE_M, 0.0, 1.0), 0.0)
        return StepDamping(tendons=-self._damping * loose)


class TendonSlack(Effect):
    """Each tendon is too long by `length`: between pulling and pushing lies a dead band of twice that."""

    name = "tendon_slack"
    family = "tendons"
    stage = "tail"
    physics = "A loose line pulls only after its slack is taken up; a pair of lines leaves the tail free in between."
    source = "Dead band of a cable drive; MuJoCo's tendon springlength with two values."
    seen_in = frozenset({"dry", "swim"})
    parameters = (Parameter("length", "m", 0.0, 0.01, 0.001),)

    def mjcf(self, spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene, values: np.ndarray) -> None:
        """A range of lengths at rest."""
        if values[0] > 0 and scene.with_tendons:
            set_rest_lengths(spec, rest_lengths(spec, robot) + values[0] * np.array([-1.0, 1.0]))

    def damping(
        self, robot: RobotSpec, scene: Scene, models: Sequence[mujoco.MjModel], values: np.ndarray
    ) -> Callable[[StepState], StepDamping] | None:
        """None within it."""
        return LooseTendons(robot, models) if values.any() and scene.with_tendons else None


EFFECT = TendonSlack()
