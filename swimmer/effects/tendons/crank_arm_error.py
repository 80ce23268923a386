"""A crank arm that is longer or shorter than described."""

import numpy as np

from swimmer.effects.effect import Effect, Parameter
from swimmer.robot import RobotSpec


class CrankArmError(Effect):
    """The tendons are pulled further, or less far, by the share `relative`."""

    name = "crank_arm_error"
    family = "tendons"
    stage = "tail"
    physics = "The tendon's stroke, and with it the tail's amplitude, grows with the radius of its anchor."
    source = "Geometry; the paper identifies 39.5 mm where 40 mm were measured."
    seen_in = frozenset({"dry", "swim"})
    parameters = (Parameter("relative", "1", -0.25, 0.25, 0.05),)

    def robot(self, robot: RobotSpec, values: np.ndarray) -> RobotSpec:
        """With another arm."""
        arm_m = float(robot.crank.arm_m * (1 + values[0]))
        return robot.model_copy(update={"crank": robot.crank.model_copy(update={"arm_m": arm_m})})


EFFECT = CrankArmError()
