"""Dry friction in the hinges."""

from collections.abc import Sequence

import mujoco
import numpy as np

from swimmer.effects.dry_friction import DryFriction
from swimmer.effects.effect import Effect, Parameter, StepDamper
from swimmer.mjcf import Scene
from swimmer.robot import RobotSpec


class JointFriction(Effect):
    """A hinge resists its motion with the same torque at any speed."""

    name = "joint_friction"
    family = "structure"
    stage = "tail"
    physics = "Coulomb friction: a torque against the hinge's motion that does not depend on its speed."
    source = "Coulomb (1785); smoothed about zero speed."
    seen_in = frozenset({"free_decay", "dry", "swim"})
    parameters = (Parameter("torque", "N m", 0.0, 0.3, 0.03),)

    def damping(
        self, robot: RobotSpec, scene: Scene, models: Sequence[mujoco.MjModel], values: np.ndarray
    ) -> StepDamper | None:
        """The same in every hinge."""
        return DryFriction(np.repeat(values, len(robot.hinges), axis=1)) if values.any() else None


EFFECT = JointFriction()
