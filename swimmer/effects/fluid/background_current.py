"""Water that moves through the pool as a whole."""

import mujoco
import numpy as np

from swimmer.effects.effect import Effect, Parameter
from swimmer.effects.seen import View
from swimmer.mjcf import Scene
from swimmer.robot import RobotSpec

_MOST_M_S, _SD_M_S = 0.15, 0.02


class BackgroundCurrent(Effect):
    """A uniform, steady current, the same in the pool in all trials.

    In one trial its components are those of the frame in which the head starts at the origin, heading along -x. The
    velocity that a run starts with is the head's in the pool, as a camera measures it, so it stays as it is. The forces
    of other effects take the water to be at rest.
    """

    name = "background_current"
    family = "fluid"
    stage = "body"
    physics = "Forces depend on the velocity relative to the water, which is that in the pool less the current's."
    source = "Galilean invariance; MuJoCo's option wind."
    seen_in = frozenset({"swim"})
    parameters = (
        Parameter("right", "m/s", -_MOST_M_S, _MOST_M_S, _SD_M_S),
        Parameter("down", "m/s", -_MOST_M_S, _MOST_M_S, _SD_M_S),
    )

    def in_trial(self, view: View, values: np.ndarray) -> np.ndarray:
        """Turned from the picture into the frame of the trial."""
        down_x, down_y = view.down
        return np.asarray(values[0] * np.array([-down_y, down_x]) + values[1] * view.down)

    def mjcf(self, spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene, values: np.ndarray) -> None:
        """As the engine's wind."""
        if scene.in_water and values.any():
            spec.option.wind = (*values, 0.0)


EFFECT = BackgroundCurrent()
