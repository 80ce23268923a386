"""Water that answers to a change of motion with a delay."""

import numpy as np

from swimmer.effects.effect import Effect, Parameter, StepForce, StepState
from swimmer.effects.fluid.plates import Plates
from swimmer.mjcf import Scene
from swimmer.robot import RobotSpec

AT_ONCE = 0.5
"""Share of the force that follows the motion at once: Wagner's function at time 0."""
SLOW_M_S = 0.02
"""At which a wake is left behind by a fish at rest."""


class _Wake:
    """Holds back a share of the water's force, which comes as the wake is left; exact for a force that changes evenly.

    The way is that of the plates' surface on the mean. Each step is given the force of the step before: with a share
    below 1 held back this cannot grow, however strong the drag.
    """

    def __init__(self, plates: Plates, way_m: np.ndarray, timestep_s: float) -> None:
        self.plates, self.way_m, self.timestep_s = plates, way_m, timestep_s
        area = plates.half_m[:, [0]] * plates.half_m[:, [2]]
        self.share = area / area.sum()  # (p, 1)
        self.late: float | np.ndarray = 0.0
        self.before: float | np.ndarray = 0.0  # no wake at the start

    @np.errstate(over="ignore", invalid="ignore")  # a simulation that blows up is marked later
    def __call__(self, state: StepState) -> np.ndarray:
        passed_m = self.timestep_s * np.hypot(np.abs(self.plates.motion(state).velocity) @ self.share, SLOW_M_S)
        steps = np.divide(passed_m, self.way_m, out=np.full(passed_m.shape, np.inf), where=self.way_m > 0)
        kept = np.exp(-steps)
        late = kept * self.late + (1 - kept) / steps * (state.fluid - self.before)
        self.late, self.before = late, state.fluid.copy()
        return np.asarray(-(1 - AT_ONCE) * late)


class FluidMemory(Effect):
    """Half of the water's force comes at once, the rest as the wake that it must build up is left behind.

    The lag is that of the whole force on each joint; the engine does not tell drag from lift.
    """

    name = "fluid_memory"
    family = "fluid"
    stage = "body"
    physics = "The vortex shed at a change of circulation holds half of it back until it has been left behind."
    source = "Wagner (1925); Jones, NACA report 681 (1940), here with one exponential; Theodorsen, report 496 (1935)."
    seen_in = frozenset({"swim"})
    parameters = (Parameter("way", "m", 0.0, 0.1, 0.004),)

    def force(self, robot: RobotSpec, scene: Scene, values: np.ndarray) -> StepForce | None:
        """With a state of its own."""
        return _Wake(Plates(robot, scene), values, scene.timestep_s) if scene.in_water and values.any() else None


EFFECT = FluidMemory()
