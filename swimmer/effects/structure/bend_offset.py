"""A tail that has taken a set: its hinges rest bent."""

import mujoco
import numpy as np

from swimmer.effects.effect import Effect, Parameter
from swimmer.effects.tendons.path import rest_lengths, set_rest_lengths
from swimmer.mjcf import Scene
from swimmer.robot import RobotSpec


class BendOffset(Effect):
    """Every hinge rests at `angle`; the tendons keep the lengths at which they hold the tail straight.

    So with tendons the tail bends only as far as they let it.
    """

    name = "bend_offset"
    family = "structure"
    stage = "tail"
    physics = "Warped printing or creep moves the angle at which a hinge's torque is zero."
    source = "Hooke's law about another point."
    seen_in = frozenset({"free_decay", "dry", "swim"})
    parameters = (Parameter("angle", "rad", -0.3, 0.3, 0.03),)

    def mjcf(self, spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene, values: np.ndarray) -> None:
        """Spring references of the hinges, which the compiler would take for the tendons too."""
        if values[0]:
            for hinge in robot.hinges:
                spec.joint(hinge).springref = float(values[0])
            if scene.with_tendons:
                set_rest_lengths(spec, rest_lengths(spec, robot))


EFFECT = BendOffset()
