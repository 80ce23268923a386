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

    The robot is one long surface, so that water cannot pass between two plates, and leaves its last edge smoothly:
    pi/4 rho d^2 a length for depth d.
    """
    half_length, _, half_height = plates.half_m.T
    return np.asarray(robot.water.density_kg_m3 * np.pi * half_height**2 * 2 * half_length)


class _Reactive:
    """Elongated body theory's reactive force, of plates whose model holds the water m behind each as its own mass.

    With v_x along, tailwards, and v_y across a plate and w its turning, the water answers with -m dv_y/dt across,
    m v_y w along and the torque -m v_x v_y (Kirchhoff's equations), and what leaves the last edge at v_t across it
    takes with it m' v_x v_t across and -1/2 m' v_t^2 along, m' a length. The engine does part of this:
    m (dv/dt + w x v), of which m a_x along and m w v_x across are given back, a the acceleration in the pool; and the
    terms without acceleration, of ellipsoids by themselves, which give way to the plates'.

    The acceleration of the step to come is that of the last two, drawn on in a straight line: this settles, since the
    engine has in hand all of the inertia that it is spared (z^2 = r (2 z - 1) with 0 <= r < 1 the share of it along the
    plates has |z| < 1).
    """

    def __init__(self, robot: RobotSpec, plates: Plates, share: np.ndarray, timestep_s: float) -> None:
        self.plates, self.timestep_s = plates, timestep_s
        water, density = water_behind_kg(robot, plates), robot.water.density_kg_m3
        self.mass_kg = share * water  # (n, p)
        self.beyond_kg = share * (water - density * np.array([added_mass(half)[0][1] for half in plates.half_m]))
        self.rear_m = plates.half_m[-1, 0]
        self.edge_kg_m = self.mass_kg[:, -1] / (2 * self.rear_m)
        self.velocity: np.ndarray | None = None
        self.gained: float | np.ndarray = 0.0  # in the last step, m/s

    @np.errstate(over="ignore", invalid="ignore")  # a simulation that blows up is marked later
    def __call__(self, state: StepState) -> np.ndarray:
        motion = self.plates.motion(state)
        gained = 0.0 if self.velocity is None else motion.velocity - self.velocity
        coming = 2 * gained - self.gained
        self.velocity, self.gained = motion.velocity, gained
        own, turning = motion.along.conj() * motion.velocity, motion.turning
        lengthwise = np.real(motion.along.conj() * coming) / self.timestep_s
        force = self.mass_kg * (lengthwise + 1j * turning * own.real) + self.beyond_kg * own.imag * turning
        torque = -self.beyond_kg * own.real * own.imag
        at_edge = own.imag[:, -1] + turning[:, -1] * self.rear_m
        shed = self.edge_kg_m * (1j * own.real[:, -1] * at_edge - 0.5 * at_edge**2)
        force[:, -1] += shed
        torque[:, -1] += self.rear_m * shed.imag
        return self.plates.generalised(force * motion.along, motion, torque)


class AddedMassReaction(Effect):
    """Water that must be accelerated with the body, and is left behind with what it has gained.

    Without what is left behind the kinetic energy would be the body's plus 1/2 scale m_A v_y^2, and stay; the wake
    takes 1/2 m' v_t^2 of it a length of way. At scale 1 all is as in elongated body theory, which makes too much of a
    fin that is higher than it is long: by itself in the water it would carry an eighth as much.
    """

    name = "added_mass_reaction"
    family = "fluid"
    stage = "body"
    physics = "Reaction -d(m_A v_y)/dt to the acceleration of a plate across itself; its momentum is shed at the tail."
    source = (
        "Lighthill, Proc. R. Soc. B 179 (1971), m_A = pi/4 rho d^2 a length; Candelier, Boyer and Leroyer, J. Fluid "
        "Mech. 673 (2011); Kirchhoff's equations (Lamb, article 124), of which MuJoCo has all but the acceleration."
    )
    seen_in = frozenset({"swim"})
    parameters = (Parameter("scale", "1", 0.0, 1.0, 0.2),)

    def mjcf(self, spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene, values: np.ndarray) -> None:
        """As mass of the plates: so the engine solves for what acts across them together with all other inertia."""
        if values[0] > 0 and scene.in_water:
            plates = Plates(robot, scene)
            for name, mass in zip(plates.names, water_behind_kg(robot, plates), strict=True):
                spec.geom(name).mass += float(values[0] * mass)

    def force(self, robot: RobotSpec, scene: Scene, values: np.ndarray) -> StepForce | None:
        """Frees them along themselves, and sheds."""
        if not scene.in_water or not values.any():
            return None
        return _Reactive(robot, Plates(robot, scene), values, scene.timestep_s)


EFFECT = AddedMassReaction()
