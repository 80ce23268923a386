"""Hinges that damp more or less than described."""

import numpy as np

from swimmer.effects.effect import Effect, Parameter
from swimmer.robot import RobotSpec


class JointDamping(Effect):
    """All hinges alike damp more by the share `relative`."""

    name = "joint_damping"
    family = "structure"
    stage = "tail"
    physics = "The torque against the motion of every hinge, in proportion to its speed, differs by the same share."
    source = "Kelvin-Voigt material; loss factors of printed plastics and rubbers vary severalfold."
    seen_in = frozenset({"free_decay", "dry", "swim"})
    parameters = (Parameter("relative", "1", -0.5, 5.0, 0.5),)

    def robot(self, robot: RobotSpec, values: np.ndarray) -> RobotSpec:
        """With other hinges."""
        damping = float(robot.tail.hinge_damping_n_m_s * (1 + values[0]))
        return robot.model_copy(update={"tail": robot.tail.model_copy(update={"hinge_damping_n_m_s": damping})})


EFFECT = JointDamping()
