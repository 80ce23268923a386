"""Tendons of unequal length: the tail is bent where the crank should hold it straight."""

import mujoco
import numpy as np

from swimmer.effects.effect import Effect, Parameter
from swimmer.effects.tendons.path import rest_lengths, set_rest_lengths
from swimmer.mjcf import Scene
from swimmer.robot import RobotSpec


class TendonAsymmetry(Effect):
    """The left tendon is shorter by `length` and the right one longer: the tail is pulled to the left."""

    name = "tendon_asymmetry"
    family = "tendons"
    stage = "tail"
    physics = "Lines that were cut or wound unequally move the middle of the beat to one side."
    source = "Geometry: a shift of the tail's path length equal to a shift of the crank's stroke."
    seen_in = frozenset({"dry", "swim"})
    parameters = (Parameter("length", "m", -0.006, 0.006, 0.001),)

    def mjcf(self, spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene, values: np.ndarray) -> None:
        """Other lengths at rest."""
        if values[0] and scene.with_tendons:
            set_rest_lengths(spec, rest_lengths(spec, robot) + values[0] * np.array([[-1.0], [1.0]]))


EFFECT = TendonAsymmetry()
