"""A head and a caudal fin whose fluid coefficients are not those of the tail."""

import mujoco
import numpy as np

from swimmer.effects.effect import Effect, Parameter
from swimmer.mjcf import Scene
from swimmer.robot import RobotSpec

_PLATES = ("head_fluid", "caudal_fin")


class SegmentCoefficients(Effect):
    """All five coefficients of the head, and of the fin, are those of the tail times exp(parameter)."""

    name = "segment_coefficients"
    family = "fluid"
    stage = "body"
    physics = "Drag and lift coefficients depend on shape: a bluff head, and a fin with free edges, differ from a tail."
    source = "Hoerner, Fluid-Dynamic Drag (1965), chapter 3: plates and bodies by proportion and bluntness."
    seen_in = frozenset({"swim"})
    parameters = (Parameter("ln_head", "1", -1.0, 1.0, 0.3), Parameter("ln_fin", "1", -1.0, 1.0, 0.3))

    def mjcf(self, spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene, values: np.ndarray) -> None:
        """The factors."""
        for name, value in zip(_PLATES, values, strict=True):
            spec.geom(name).fluid_coefs = np.exp(value) * spec.geom(name).fluid_coefs


EFFECT = SegmentCoefficients()
