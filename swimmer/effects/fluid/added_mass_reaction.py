"""The inertia of the water that a plate accelerates across itself."""

import mujoco
import numpy as np

from swimmer.effects.effect import Effect, Parameter, StepForce, StepState
from swimmer.effects.fluid.plates import Plates
from swimmer.fluid import added_mass
from swimmer.mjcf import Scene
from swimmer.robot import RobotSpec


def water_behind_kg(robot: RobotSpec, plates: Plates) -> np.ndarray:
    """(p,) mass of the water that each plate carries when it moves across itself, spread evenly along it.

    Head and tail are one long surface, so that water cannot pass between two links: pi/4 rho d^2 a length for depth d.
    The fin is shorter than it is high, and water gets round its rear edge: that of its ellipsoid.
    """
    half_length, _, half_height = plates.half_m.T
    strips = np.pi * half_height**2 * 2 * half_length
    fin, _ = added_mass(plates.half_m[-1])
    return robot.water.density_kg_m3 * np.append(strips[:-1], fin[1])


class _Slip:
    """Lets plates slip lengthwise through the water that the model has made a part of them.

    The engine resists with m (dv/dt + w x v), in the axes of a plate; the water does with m dv_y/dt alone. The
    difference is m a_x along the plate, a the acceleration in the pool, and m w v_x across it. The acceleration of the
    step to come is that of the last two, drawn on in a straight line: this settles, since the engine has in hand all of
    the inertia that it is spared (z^2 = r (2 z - 1) with 0 <= r < 1 the share of it along the plates has |z| < 1).
    """

    def __init__(self, plates: Plates, mass_kg: np.ndarray, timestep_s: float) -> None:
        self.plates, self.mass_kg, self.timestep_s = plates, mass_kg, timestep_s
        self.velocity: np.ndarray | None = None
        self.gained: float | np.ndarray = 0.0  # in the last step, m/s

    @np.errstate(over="ignore", invalid="ignore")  # a simulation that blows up is marked later
    def __call__(self, state: StepState) -> np.ndarray:
        motion = self.plates.motion(state)
        gained = 0.0 if self.velocity is None else motion.velocity - self.velocity
        coming = 2 * gained - self.gained
        self.velocity, self.gained = motion.velocity, gained
        backward = motion.along.conj()
        lengthwise = np.real(backward * coming) / self.timestep_s
        across = motion.turning * np.real(backward * motion.velocity)
        return self.plates.generalised(self.mass_kg * (lengthwise + 1j * across) * motion.along, motion)


class AddedMassReaction(Effect):
    """Water that must be accelerated with the body; at scale 1 as much as slender body theory says.

    The engine holds the other part of the added mass, the force (m_A v) x w and the torque (m_A v) x v of the links'
    ellipsoids. It does no work, so at any scale the kinetic energy is the body's plus 1/2 scale m_A v_y^2. The
    reaction of a tail that beats on the spot is the thrust of elongated body theory, 1/2 m <h_t^2>; what that theory
    takes off when it moves on, 1/2 m U^2 <h_x^2>, is water shed at the tail's end, which is left to Kutta lift here.
    """

    name = "added_mass_reaction"
    family = "fluid"
    stage = "body"
    physics = "Reaction -m_A dv/dt, -I_A dw/dt to the acceleration of a plate across itself."
    source = (
        "Kirchhoff's equations (Lamb, Hydrodynamics, article 124); m_A = pi/4 rho d^2 a length (Lighthill, J. Fluid "
        "Mech. 9 (1960)); MuJoCo computes only the part that depends on velocities."
    )
    seen_in = frozenset({"swim"})
    parameters = (Parameter("scale", "1", 0.0, 1.5, 0.7),)

    def mjcf(self, spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene, values: np.ndarray) -> None:
        """As mass of the plates: so the engine solves for what acts across them together with all other inertia."""
        if values[0] > 0 and scene.in_water:
            plates = Plates(robot, scene)
            for name, mass in zip(plates.names, water_behind_kg(robot, plates), strict=True):
                spec.geom(name).mass += float(values[0] * mass)

    def force(self, robot: RobotSpec, scene: Scene, values: np.ndarray) -> StepForce | None:
        """Frees them along themselves."""
        if not scene.in_water or not values.any():
            return None
        plates = Plates(robot, scene)
        return _Slip(plates, values * water_behind_kg(robot, plates), scene.timestep_s)


EFFECT = AddedMassReaction()
