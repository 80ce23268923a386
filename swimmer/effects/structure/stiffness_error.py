"""Hinges that are stiffer or softer than described."""

import numpy as np

from swimmer.effects.effect import Effect, Parameter
from swimmer.robot import RobotSpec


class StiffnessError(Effect):
    """All hinges alike are stiffer by the share `relative`."""

    name = "stiffness_error"
    family = "structure"
    stage = "tail"
    physics = "The restoring torque of every hinge differs by the same share."
    source = "Hooke's law; plates bend with the cube of a thickness that printing holds to a few hundredths."
    seen_in = frozenset({"free_decay", "dry", "swim"})
    parameters = (Parameter("relative", "1", -0.3, 1.5, 0.1),)

    def robot(self, robot: RobotSpec, values: np.ndarray) -> RobotSpec:
        """With other hinges."""
        stiffness = float(robot.tail.hinge_stiffness_n_m * (1 + values[0]))
        return robot.model_copy(update={"tail": robot.tail.model_copy(update={"hinge_stiffness_n_m": stiffness})})


EFFECT = StiffnessError()
