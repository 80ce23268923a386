"""Hinges that stiffen as they bend."""

import mujoco
import numpy as np

from swimmer.effects.effect import Effect, Parameter
from swimmer.mjcf import Scene
from swimmer.robot import RobotSpec


class StiffnessHardening(Effect):
    """The torque of a hinge is k q (1 + `cubic` q^2)."""

    name = "stiffness_hardening"
    family = "structure"
    stage = "tail"
    physics = "A flexible gap that closes on one side and stretches on the other resists more than in proportion."
    source = "Duffing (1918): the first odd term beyond Hooke's law."
    seen_in = frozenset({"free_decay", "dry", "swim"})
    parameters = (Parameter("cubic", "1/rad^2", 0.0, 20.0, 2.0),)

    def mjcf(self, spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene, values: np.ndarray) -> None:
        """The third number of a joint's stiffness is the factor of q^3."""
        if values[0] > 0:
            for hinge in robot.hinges:
                joint = spec.joint(hinge)
                joint.stiffness = joint.stiffness[0] * np.array([1.0, 0.0, values[0]])


EFFECT = StiffnessHardening()
