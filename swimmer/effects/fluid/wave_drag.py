"""Waves that a swimmer at the surface makes and leaves behind."""

import numpy as np

from swimmer.effects.effect import Effect, Parameter, StepForce, StepState
from swimmer.effects.fluid.plates import Plates
from swimmer.mjcf import Scene
from swimmer.robot import RobotSpec

GRAVITY_M_S2 = 9.81
HUMP_FROUDE = 0.5
"""Where the bow's waves are twice as long as the hull, and their drag is greatest."""


def hump(froude: np.ndarray) -> np.ndarray:
    """Wave drag coefficient by Froude number against that on the hump: 2 x^4 / (1 + x^8) with x = Fr / 0.5.

    Rises as Fr^4 (a resistance with the sixth power of speed) and falls as fast behind the hump, where a hull planes.
    """
    x4 = (froude / HUMP_FROUDE) ** 4
    return np.asarray(2 * x4 / (1 + x4**2))


class _Waves:
    """Drag along the head's axis."""

    def __init__(self, robot: RobotSpec, plates: Plates, on_hump: np.ndarray) -> None:
        self.plates = plates
        self.hull_speed = np.sqrt(GRAVITY_M_S2 * 2 * plates.half_m[0, 0])  # Fr = 1
        self.scale = 0.5 * robot.water.density_kg_m3 * robot.elongated_body.reference_area_m2 * on_hump[:, 0]

    @np.errstate(over="ignore", invalid="ignore")  # a simulation that blows up is marked later
    def __call__(self, state: StepState) -> np.ndarray:
        motion = self.plates.motion(state)
        head = motion.along[:, 0]
        speed = np.real(head.conj() * motion.velocity[:, 0])
        force = np.zeros_like(motion.place)
        force[:, 0] = -self.scale * hump(np.abs(speed) / self.hull_speed) * np.abs(speed) * speed * head
        return self.plates.generalised(force, motion)


class WaveDrag(Effect):
    """A drag that is nothing when slow and rises steeply towards the speed of waves as long as the head."""

    name = "wave_drag"
    family = "fluid"
    stage = "body"
    physics = "Drag 1/2 rho S c(Fr) U^2 with a hump at Fr = U / sqrt(g L) = 0.5, L the hull's (head's) length."
    source = "Havelock, Proc. R. Soc. A 89 (1914); Hoerner, Fluid-Dynamic Drag (1965), chapter 11."
    seen_in = frozenset({"swim"})
    parameters = (Parameter("on_hump", "1", 0.0, 4.0, 0.5),)

    def force(self, robot: RobotSpec, scene: Scene, values: np.ndarray) -> StepForce | None:
        """On the head."""
        return _Waves(robot, Plates(robot, scene), values) if scene.in_water and values.any() else None


EFFECT = WaveDrag()
