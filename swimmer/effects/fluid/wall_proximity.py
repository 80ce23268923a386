"""A wall of the pool alongside."""

import numpy as np

from swimmer.effects.effect import Effect, Parameter, StepForce, StepState
from swimmer.effects.fluid.plates import Plates
from swimmer.mjcf import Scene
from swimmer.robot import RobotSpec

DRAG = 1.2
"""Of a plate that moves broadside: Hoerner, Fluid-Dynamic Drag (1965), chapter 3. The wall adds a share of it."""
LIFT = 1.0
"""Towards the wall, of a plate that moves along it; of order one (Quinn, Lauder and Smits 2014)."""
COURSE_S = 1.0
"""Over which a heading that swings from beat to beat is averaged to a course."""


class _Wall:
    """A wall 1 / nearness to the left of the start: forces on every plate by its own clearance c and half depth h.

    It runs along the course, the heading of which `COURSE_S` are remembered. The share (h / c)^2 is levelled off to
    h^2 / (c^2 + h^2), and the lift to 0, where a plate touches the wall.
    """

    def __init__(self, robot: RobotSpec, plates: Plates, nearness: np.ndarray, timestep_s: float) -> None:
        self.plates, self.nearness = plates, nearness
        self.turned = -np.expm1(-timestep_s / COURSE_S)  # share of a step in the course
        self.course: complex | np.ndarray = 1.0 + 0.0j  # (n, 1) backward along it
        half_length, _, self.half_height = plates.half_m.T
        self.pressed = 0.5 * robot.water.density_kg_m3 * 4 * half_length * self.half_height  # 1/2 rho S

    @np.errstate(over="ignore", invalid="ignore")  # a simulation that blows up is marked later
    def __call__(self, state: StepState) -> np.ndarray:
        motion = self.plates.motion(state)
        course = self.course / np.abs(self.course)
        self.course = course + self.turned * (motion.along[:, :1] - course)
        velocity = motion.velocity * np.conj(course)
        clearance = 1 + self.nearness * np.imag(motion.place * np.conj(course))  # by the distance at the start
        depth = self.nearness * self.half_height
        far = np.hypot(clearance, depth)
        share = (depth / far) ** 2
        along, across = velocity.real, velocity.imag
        drag = -DRAG * share * np.abs(across) * across
        lift = -LIFT * share * along**2 * np.sign(self.nearness) * clearance / far
        return self.plates.generalised(1j * self.pressed * (drag + lift) * course, motion)


class WallProximity(Effect):
    """A wall parallel to the course, given by its distance from the start, to the power -2: left +, right -.

    In proportion to it is what a distant wall does.
    """

    name = "wall_proximity"
    family = "fluid"
    stage = "body"
    physics = (
        "A wall at clearance c adds a share (h / c)^2 to the drag across it and draws a passing body of half depth h "
        "towards it."
    )
    source = "Images in a plane (Lamb, Hydrodynamics, article 137); Quinn, Lauder and Smits, J. Fluid Mech. 742 (2014)."
    seen_in = frozenset({"swim"})
    parameters = (Parameter("inverse_square", "1/m^2", -64.0, 64.0, 8.0),)

    def force(self, robot: RobotSpec, scene: Scene, values: np.ndarray) -> StepForce | None:
        """Across the wall."""
        nearness = np.sign(values) * np.sqrt(np.abs(values))
        return (
            _Wall(robot, Plates(robot, scene), nearness, scene.timestep_s) if scene.in_water and values.any() else None
        )


EFFECT = WallProximity()
