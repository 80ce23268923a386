"""Water that the tail carries along."""

import mujoco
import numpy as np

from swimmer.effects.effect import Effect, Parameter
from swimmer.mjcf import Scene
from swimmer.robot import RobotSpec


class EntrainedWater(Effect):
    """A layer of water, `thickness` deep on both sides of the tail's plates and fin, moves as if it were part of them.

    Unlike added mass it weighs alike in all directions. It hangs on the plates' surface, so its moment of inertia is
    that of a plate.
    """

    name = "entrained_water"
    family = "structure"
    stage = "tail"
    physics = "Skin, sponge and gaps hold water that takes part in every acceleration; in air it has run off."
    source = "Newton's second law for rho times the volume held."
    seen_in = frozenset({"swim"})
    parameters = (Parameter("thickness", "m", 0.0, 0.02, 0.002),)

    def mjcf(self, spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene, values: np.ndarray) -> None:
        """Heavier plates."""
        if values[0] > 0 and scene.in_water:
            for name in (*(f"{hinge}_plate" for hinge in robot.hinges), "caudal_fin"):
                plate = spec.geom(name)
                side_m2 = 4 * plate.size[0] * plate.size[2]
                plate.mass += float(2 * values[0] * side_m2 * robot.water.density_kg_m3)


EFFECT = EntrainedWater()
