"""Water that answers to a change of motion with a delay."""

import numpy as np

from swimmer.effects.effect import Effect, Parameter, StepForce, StepState
from swimmer.mjcf import Scene
from swimmer.robot import RobotSpec

AT_ONCE = 0.5
"""Share of the force that follows the motion at once: Wagner's function at time 0."""


class _Wake:
    """Holds back a share of the water's force, which comes with a first-order lag; exact for a force held over a step.

    Each step is given the force of the step before: with a share below 1 held back this cannot grow, however strong
    the drag.
    """

    def __init__(self, lag_s: np.ndarray, timestep_s: float) -> None:
        steps = np.divide(timestep_s, lag_s, out=np.full(lag_s.shape, np.inf), where=lag_s > 0)
        self.kept = np.exp(-steps)  # (n, 1) of the old force over a step
        self.lagged: float | np.ndarray = 0.0  # no wake at the start

    @np.errstate(over="ignore", invalid="ignore")  # a simulation that blows up is marked later
    def __call__(self, state: StepState) -> np.ndarray:
        late = self.kept * (state.fluid - self.lagged)
        self.lagged = state.fluid - late
        return np.asarray(-(1 - AT_ONCE) * late)


class FluidMemory(Effect):
    """Half of the water's force comes at once, the rest with the wake that it must first build up.

    The lag is that of the whole force on each joint; the engine does not tell drag from lift.
    """

    name = "fluid_memory"
    family = "fluid"
    stage = "body"
    physics = "The vortex shed at a change of circulation holds half of it back until it has been left behind."
    source = "Wagner (1925); Jones, NACA report 681 (1940), here with one exponential; Theodorsen, report 496 (1935)."
    seen_in = frozenset({"swim"})
    parameters = (Parameter("lag", "s", 0.0, 0.5, 0.05),)

    def force(self, robot: RobotSpec, scene: Scene, values: np.ndarray) -> StepForce | None:
        """With a state of its own."""
        return _Wake(values, scene.timestep_s) if scene.in_water and values.any() else None


EFFECT = FluidMemory()
