"""A tail that is stiffer at one end than at the other."""

import mujoco
import numpy as np

from swimmer.effects.effect import Effect, Parameter
from swimmer.mjcf import Scene
from swimmer.robot import RobotSpec


class StiffnessGradient(Effect):
    """Stiffness goes evenly from (1 - `relative`) at the first hinge to (1 + `relative`) times at the last.

    The mean over the hinges stays.
    """

    name = "stiffness_gradient"
    family = "structure"
    stage = "tail"
    physics = "Hinges of unequal height or thickness share the bend unequally."
    source = "Hooke's law; a plate's bending stiffness is E h t^3 / 12 a length."
    seen_in = frozenset({"free_decay", "dry", "swim"})
    parameters = (Parameter("relative", "1", -0.8, 0.8, 0.2),)

    def mjcf(self, spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene, values: np.ndarray) -> None:
        """Each hinge its own stiffness."""
        if values[0] and len(robot.hinges) > 1:
            for hinge, place in zip(robot.hinges, np.linspace(-1.0, 1.0, len(robot.hinges)), strict=True):
                joint = spec.joint(hinge)
                joint.stiffness = joint.stiffness * (1 + values[0] * place)


EFFECT = StiffnessGradient()
