"""Tendons that stretch more than described."""

import mujoco
import numpy as np

from swimmer.effects.effect import Effect, Parameter
from swimmer.mjcf import SIDES, Scene
from swimmer.robot import RobotSpec


class TendonCompliance(Effect):
    """The tendons, or what holds them, give (1 + `relative`) times as much under the same force."""

    name = "tendon_compliance"
    family = "tendons"
    stage = "tail"
    physics = "Line, knots and anchors are springs in series: their compliances 1/k add up."
    source = "Hooke's law; spring and damper change together, as with a longer piece of the same line."
    seen_in = frozenset({"dry", "swim"})
    parameters = (Parameter("relative", "1", 0.0, 20.0, 2.0),)

    def mjcf(self, spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene, values: np.ndarray) -> None:
        """Softer springs, with the same time constant."""
        if values[0] > 0 and scene.with_tendons:
            for side, _ in SIDES:
                tendon = spec.tendon(f"tendon_{side}")
                tendon.stiffness = tendon.stiffness / (1 + values[0])
                tendon.damping = tendon.damping / (1 + values[0])


EFFECT = TendonCompliance()
