"""Effects of the water: floating, added mass, wakes, currents, walls, waves and drag.

Effects of a body that floats (`SurfaceMotion`, `HullRoll`) come first: it rolls and pitches, and raised markers swing
with it. All others are forces of the water on the robot's plates.
"""

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np

from swimcal.effects.effect import Effect, Observation, Parameter, Plates, StepForce, StepState, View
from swimcal.mjcf import Scene, added_volumes
from swimcal.robot import RobotSpec

# `SurfaceMotion`: a small float.
ROLL_HZ = 2.0
"""Natural frequency of a small float in roll."""

PITCH_HZ = 1.6
"""Natural frequency of a small float in pitch."""

DAMPING = 0.2
"""Damping ratio of a small float in roll and pitch."""
_HARMONICS = np.arange(1, 4)

# `HullRoll`: a hull that rolls about a long axis.
NATURAL_ROLL_HZ = 0.6
"""Natural roll frequency of a hull with little righting moment; `natural` is the logarithm of the ratio to it."""

# `SegmentCoefficients`.
_PLATES = ("head_fluid", "caudal_fin")

# `FluidMemory`: the wake that is left behind.
AT_ONCE = 0.5
"""Share of the force that follows the motion at once: Wagner's function at time 0."""
SLOW_M_S = 0.02
"""Speed at which a wake is left behind by a fish at rest."""

# `WallProximity`: forces of a wall on the plates.
DRAG = 1.2
"""Drag coefficient of a plate that moves broadside: Hoerner, Fluid-Dynamic Drag (1965), chapter 3.

The wall adds a share of it.
"""
LIFT = 1.0
"""Lift coefficient towards the wall of a plate that moves along it; of order one (Quinn, Lauder and Smits 2014)."""
COURSE_S = 1.0
"""Time over which a heading that swings from beat to beat is averaged to a course."""

# `WaveDrag`.
GRAVITY_M_S2 = 9.81
HUMP_FROUDE = 0.5
"""Froude number at which the drag of the waves is greatest; they are 2 pi 0.5^2 = 1.6 hulls long."""


def roll_response(driven: np.ndarray, beat_rad: np.ndarray, time_s: np.ndarray, natural_hz: float) -> np.ndarray:
    """Return the lasting answer x (f,) of x'' + 2 z w x' + w^2 x = w^2 d to a drive d (f,); w = 2 pi natural_hz.

    Args:
        driven: (f,) the drive d, of which the first three harmonics of the beat count.
        beat_rad: (f,) angle of the crank.
        time_s: (f,) s.
        natural_hz: natural frequency of the oscillator.
    """
    turning = np.exp(1j * np.outer(beat_rad, _HARMONICS))  # (f, 3)
    columns = np.column_stack([np.ones(len(time_s)), turning.real, turning.imag])
    cosine, sine = np.linalg.lstsq(columns, driven, rcond=None)[0][1:].reshape(2, -1)
    # Ratio to the natural frequency
    faster = _HARMONICS * np.polyfit(time_s, beat_rad, 1)[0] / (2 * np.pi * natural_hz)
    answer = (cosine - 1j * sine) / (1 - faster**2 + 2j * DAMPING * faster)
    return np.asarray((turning @ answer).real)


class FloatingEffect(Effect):
    """Effect of a body that floats."""

    family = "fluid"
    stage = "camera"
    seen_in = frozenset({"swim"})


class SurfaceMotion(FloatingEffect):
    """Raised markers swing over the water line, at which nose and neck are: sideways with roll, lengthwise with pitch.

    Roll and pitch are what a damped float does when the head's acceleration shakes it, across and along: in proportion
    to it far below the natural frequency, late near it. Heave moves nothing in a picture taken from straight above and
    far, so there is none.
    """

    name = "surface_motion"
    physics = (
        "A shaken float rolls and pitches; a marker z above the water line moves by -z roll to the right, z pitch aft."
    )
    source = "Driven damped oscillator; kinematics of a floating body, small angles."
    parameters = (
        Parameter("roll", "rad s^2/m", -0.3, 0.3, 0.02),
        Parameter("pitch", "rad s^2/m", -0.6, 0.6, 0.06),
        Parameter("pitch_over_height", "rad s^2/m^2", -0.3, 0.3, 0.025),
    )

    def observe(self, seen: Observation, values: np.ndarray) -> np.ndarray:
        """Swing the markers about the axes of the head, as its upright hinges make the tail roll and pitch along."""
        nose = seen.names.index("nose")
        if not values.any() or not np.isfinite(seen.marker_m).all():
            return seen.marker_m
        axes = seen.axes[:, nose]  # (f, 2, 2): backward, right
        velocity = np.gradient(seen.marker_m[:, nose], seen.time_s, axis=0)
        shaken = np.einsum("fkd,fd->fk", axes, np.gradient(velocity, seen.time_s, axis=0))  # m/s^2
        pitch, roll = (
            roll_response(value * shaken[:, k], seen.crank_rad, seen.time_s, hz)
            for k, (value, hz) in enumerate(((1.0, PITCH_HZ), (values[0], ROLL_HZ)))
        )
        lean = values[1] * pitch[:, None] * axes[:, 0] - roll[:, None] * axes[:, 1]
        behind = np.einsum("fmd,fd->fm", seen.marker_m - seen.marker_m[:, [seen.names.index("neck")]], axes[:, 0])
        nearer = -values[2] * pitch[:, None] * behind  # relative to the camera's height
        swung = seen.marker_m + seen.above_m[:, None] * lean[:, None]
        return np.asarray(swung + nearer[..., None] * (seen.marker_m - seen.view.axis_m))


@dataclass(frozen=True, eq=False)
class RollingHull:
    """A hull that rolls about a long axis.

    Attributes:
        behind_neck_m: distance from the neck to the centre of mass, m.
        height_m: (m,) heights of the markers, m.
        neck: number of the neck among the markers.
    """

    behind_neck_m: float
    height_m: np.ndarray
    neck: int

    @classmethod
    def of(cls, robot: RobotSpec, markers: tuple[str, ...]) -> "RollingHull":
        """Build the hull of a robot with these markers."""
        parts = robot.head.part
        centre_m = sum(part.mass_kg * part.centre_m[0] for part in parts) / sum(part.mass_kg for part in parts)
        places = robot.marker_positions_m(markers)
        neck = markers.index("neck")
        return cls(float(centre_m - places[neck, 0]), places[:, 2], neck)

    def shift_m(
        self, time_s: np.ndarray, marker_m: np.ndarray, axes: np.ndarray, crank_rad: np.ndarray, natural_hz: float
    ) -> np.ndarray:
        """Return the swing of the markers (f, m, 2), m, by a unit roll.

        The roll is 1 rad for each metre of sway far above the natural frequency.

        Args:
            time_s: (f,) s.
            marker_m: (f, m, 2) without roll, m.
            axes: (f, m, 2, 2) axes of the links that carry them, backward and to the right.
            crank_rad: (f,) angle of the crank.
            natural_hz: natural frequency of the roll.
        """
        backward, right = axes[:, self.neck, 0], axes[:, self.neck, 1]  # (f, 2) each
        centre_m = marker_m[:, self.neck] + self.behind_neck_m * backward
        acceleration = np.gradient(np.gradient(centre_m, time_s, axis=0), time_s, axis=0)
        driven = (acceleration * right).sum(axis=1) / (2 * np.pi * natural_hz) ** 2
        roll_rad = roll_response(driven, crank_rad, time_s, natural_hz)
        return np.asarray((roll_rad[:, None] * self.height_m)[..., None] * right[:, None])


class HullRoll(FloatingEffect):
    """The whole fish rolls, most where it beats near the natural frequency of its roll.

    The water pushes it sideways below its centre of mass; a small righting moment, and a damping ratio of `DAMPING`,
    hold the roll. Markers on head and tail swing alike, by their heights over the axis. So the wave seen from above
    changes with the frequency although that in the water does not. The roll does not react on the planar motion.
    """

    name = "hull_roll"
    physics = (
        "roll'' + 2 z w roll' + w^2 roll = g a, a the head's acceleration sideways, g its mass times the height of its "
        "centre over the roll axis, by its moment of inertia."
    )
    source = "Damped oscillator of one degree of freedom: Lewandowski, The Dynamics of Marine Craft (2004), chapter 6."
    parameters = (
        Parameter("roll_per_sway", "1/m", -80.0, 80.0, 20.0),
        Parameter("natural", "1", -1.0, 1.0, 0.3),
    )

    def __init__(self, hull: RollingHull | None = None) -> None:
        self._hull = hull

    def suited(self, robot: RobotSpec, markers: tuple[str, ...]) -> Effect:
        """Return the effect with the marker heights of this robot."""
        return HullRoll(RollingHull.of(robot, markers))

    def observe(self, seen: Observation, values: np.ndarray) -> np.ndarray:
        """Swing the markers to either side."""
        if self._hull is None or not values[0] or not np.isfinite(seen.marker_m).all():
            return seen.marker_m
        natural_hz = NATURAL_ROLL_HZ * float(np.exp(values[1]))
        swung = self._hull.shift_m(seen.time_s, seen.marker_m, seen.axes, seen.crank_rad, natural_hz)
        return np.asarray(seen.marker_m + values[0] * swung)


# Forces of the water on the plates.


def water_behind_kg(robot: RobotSpec, plates: Plates) -> np.ndarray:
    """Return the mass of the water (p,) that each plate carries when it moves across itself, spread evenly along it.

    The robot is one long surface, so that water cannot pass between two plates, and leaves its last edge smoothly: pi/4
    rho d^2 a length for depth d.

    Args:
        robot: the robot, for its water.
        plates: its p plates.
    """
    half_length, _, half_height = plates.half_m.T
    return np.asarray(robot.water.density_kg_m3 * np.pi * half_height**2 * 2 * half_length)


class WaterEffect(Effect):
    """Effect of the water."""

    family = "fluid"
    stage = "body"
    seen_in = frozenset({"swim"})


class AddedMassReaction(WaterEffect):
    """Water that must be accelerated with the body, and is left behind with what it has gained.

    Without what is left behind the kinetic energy would be the body's plus 1/2 scale m_A v_y^2, and stay; the wake
    takes 1/2 m' v_t^2 of it a length of way. At scale 1 all is as in elongated body theory, which makes too much of a
    fin that is higher than it is long: by itself in the water it would carry an eighth as much.
    """

    name = "added_mass_reaction"
    physics = "Reaction -d(m_A v_y)/dt to the acceleration of a plate across itself; its momentum is shed at the tail."
    source = (
        "Lighthill, Proc. R. Soc. B 179 (1971), m_A = pi/4 rho d^2 a length; Candelier, Boyer and Leroyer, J. Fluid "
        "Mech. 674 (2011); Kirchhoff's equations (Lamb, article 124), of which MuJoCo has all but the acceleration."
    )
    parameters = (Parameter("scale", "1", 0.0, 1.0, 0.2),)

    def mjcf(self, spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene, values: np.ndarray) -> None:
        """Add the mass to the plates, so that the engine solves for it together with all other inertia."""
        if values[0] > 0 and scene.in_water:
            plates = Plates(robot, scene)
            for name, mass in zip(plates.names, water_behind_kg(robot, plates), strict=True):
                spec.geom(name).mass += float(values[0] * mass)

    def force(self, robot: RobotSpec, scene: Scene, values: np.ndarray) -> StepForce | None:
        """Return the force that frees the plates of that mass along themselves, and sheds momentum at the tail."""
        if not scene.in_water or not values.any():
            return None
        return _Reactive(robot, Plates(robot, scene), values, scene.timestep_s)


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
        self.beyond_kg = share * (water - density * np.array([added_volumes(half)[1] for half in plates.half_m]))
        self.rear_m = plates.half_m[-1, 0]
        self.edge_kg_m = self.mass_kg[:, -1] / (2 * self.rear_m)
        self.velocity: np.ndarray | None = None
        self.gained: float | np.ndarray = 0.0  # gain of velocity in the last step, m/s

    @np.errstate(over="ignore", invalid="ignore")  # a simulation that blows up is marked later
    def __call__(self, state: StepState) -> np.ndarray:
        motion = state.motion
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


class SegmentCoefficients(WaterEffect):
    """All five coefficients of the head, and of the fin, are those of the tail times exp(parameter)."""

    name = "segment_coefficients"
    physics = "Drag and lift coefficients depend on shape: a bluff head, and a fin with free edges, differ from a tail."
    source = "Hoerner, Fluid-Dynamic Drag (1965), chapter 3: plates and bodies by proportion and bluntness."
    parameters = (Parameter("ln_head", "1", -1.0, 1.0, 0.3), Parameter("ln_fin", "1", -1.0, 1.0, 0.3))

    def mjcf(self, spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene, values: np.ndarray) -> None:
        """Scale the coefficients of head and fin."""
        for name, value in zip(_PLATES, values, strict=True):
            spec.geom(name).fluid_coefs = np.exp(value) * spec.geom(name).fluid_coefs


class FluidMemory(WaterEffect):
    """Half of the water's force comes at once, the rest as the wake that it must build up is left behind.

    The lag is that of the whole force on each joint; the engine does not separate drag from lift.
    """

    name = "fluid_memory"
    physics = "The vortex shed at a change of circulation holds half of it back until it has been left behind."
    source = "Wagner (1925); Jones, NACA report 681 (1940), here with one exponential; Theodorsen, report 496 (1935)."
    parameters = (Parameter("way", "m", 0.0, 0.1, 0.004),)

    def force(self, robot: RobotSpec, scene: Scene, values: np.ndarray) -> StepForce | None:
        """Return the force of the wake, with a state of its own."""
        return _Wake(Plates(robot, scene), values, scene.timestep_s) if scene.in_water and values.any() else None


class _Wake:
    """Holds back a share of the water's force, which comes as the wake is left; exact for a force that changes evenly.

    The way is that of the plates' surface on the mean. Each step is given the force of the step before: with a share
    below 1 held back this cannot grow, however strong the drag.
    """

    def __init__(self, plates: Plates, way_m: np.ndarray, timestep_s: float) -> None:
        self.way_m, self.timestep_s = way_m, timestep_s
        area = plates.half_m[:, [0]] * plates.half_m[:, [2]]
        self.share = area / area.sum()  # (p, 1)
        self.late: float | np.ndarray = 0.0
        self.before: float | np.ndarray = 0.0  # no wake at the start

    @np.errstate(over="ignore", invalid="ignore")  # a simulation that blows up is marked later
    def __call__(self, state: StepState) -> np.ndarray:
        passed_m = self.timestep_s * np.hypot(np.abs(state.motion.velocity) @ self.share, SLOW_M_S)
        steps = np.divide(passed_m, self.way_m, out=np.full(passed_m.shape, np.inf), where=self.way_m > 0)
        kept = np.exp(-steps)
        late = kept * self.late + (1 - kept) / steps * (state.fluid - self.before)
        self.late, self.before = late, state.fluid.copy()
        return np.asarray(-(1 - AT_ONCE) * late)


class BackgroundCurrent(WaterEffect):
    """A uniform, steady current, the same in the pool in all trials.

    In one trial its components are those of the frame in which the head starts at the origin, heading along -x. The
    velocity that a run starts with is the head's in the pool, as a camera measures it, so it stays as it is. The forces
    of other effects take the water to be at rest.
    """

    name = "background_current"
    physics = "Forces depend on the velocity relative to the water, which is that in the pool less the current's."
    source = "Galilean invariance; MuJoCo's option wind."
    parameters = (Parameter("right", "m/s", -0.15, 0.15, 0.02), Parameter("down", "m/s", -0.15, 0.15, 0.02))

    def in_trial(self, view: View, values: np.ndarray) -> np.ndarray:
        """Turn the current from the picture into the frame of the trial."""
        down_x, down_y = view.down
        return np.asarray(values[0] * np.array([-down_y, down_x]) + values[1] * view.down)

    def mjcf(self, spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene, values: np.ndarray) -> None:
        """Set the current as the engine's wind."""
        if scene.in_water and values.any():
            spec.option.wind = (*values, 0.0)


class WallProximity(WaterEffect):
    """A wall parallel to the course, given by its distance from the start, to the power -2: left +, right -.

    In proportion to it is what a distant wall does.
    """

    name = "wall_proximity"
    physics = (
        "A wall at clearance c adds a share (h / c)^2 to the drag across it and draws a passing body of half depth h "
        "towards it."
    )
    source = "Images in a plane (Lamb, Hydrodynamics, article 137); Quinn, Lauder and Smits, J. Fluid Mech. 742 (2014)."
    parameters = (Parameter("inverse_square", "1/m^2", -64.0, 64.0, 8.0),)

    def force(self, robot: RobotSpec, scene: Scene, values: np.ndarray) -> StepForce | None:
        """Return the force of the wall."""
        nearness = np.sign(values) * np.sqrt(np.abs(values))
        return (
            _Wall(robot, Plates(robot, scene), nearness, scene.timestep_s) if scene.in_water and values.any() else None
        )


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
        motion = state.motion
        course = self.course / np.abs(self.course)
        self.course = course + self.turned * (motion.along[:, :1] - course)
        velocity = motion.velocity * np.conj(course)
        clearance = 1 + self.nearness * np.imag(motion.place * np.conj(course))  # relative to the distance at the start
        depth = self.nearness * self.half_height
        far = np.hypot(clearance, depth)
        share = (depth / far) ** 2
        along, across = velocity.real, velocity.imag
        drag = -DRAG * share * np.abs(across) * across
        lift = -LIFT * share * along**2 * np.sign(self.nearness) * clearance / far
        return self.plates.generalised(1j * self.pressed * (drag + lift) * course, motion)


def wave_drag_ratio(froude: np.ndarray) -> np.ndarray:
    """Return the wave drag coefficient relative to that on the hump: 2 x^4 / (1 + x^8) with x = Fr / 0.5.

    Rises as Fr^4 (a resistance with the sixth power of speed) and falls as fast behind the hump, where a hull planes.
    """
    x4 = (froude / HUMP_FROUDE) ** 4
    return np.asarray(2 * x4 / (1 + x4**2))


class WaveDrag(WaterEffect):
    """A drag that is nothing when slow and rises steeply towards the speed of waves as long as the head."""

    name = "wave_drag"
    physics = "Drag 1/2 rho S c(Fr) U^2 with a hump at Fr = U / sqrt(g L) = 0.5, L the hull's (head's) length."
    source = "Havelock, Proc. R. Soc. A 89 (1914); Hoerner, Fluid-Dynamic Drag (1965), chapter 11."
    parameters = (Parameter("on_hump", "1", 0.0, 4.0, 0.5),)

    def force(self, robot: RobotSpec, scene: Scene, values: np.ndarray) -> StepForce | None:
        """Return the drag on the head."""
        if not scene.in_water or not values.any():
            return None
        plates = Plates(robot, scene)
        hull_speed = np.sqrt(GRAVITY_M_S2 * 2 * plates.half_m[0, 0])  # Fr = 1
        scale = 0.5 * robot.water.density_kg_m3 * robot.elongated_body.reference_area_m2 * values[:, 0]
        return _AlongTheHead(plates, lambda speed: scale * wave_drag_ratio(speed / hull_speed) * speed**2)


class LinearDrag(WaterEffect):
    """A pull on the head against its velocity through the pool, in proportion to it."""

    name = "linear_drag"
    physics = "Drag c v on the head: of a cable in tow or creeping flow; a stand-in for drag that grows less than v^2."
    source = "Stokes; White, Viscous Fluid Flow (2006), chapter 3."
    parameters = (Parameter("drag", "N s/m", 0.0, 10.0, 0.5),)

    def mjcf(self, spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene, values: np.ndarray) -> None:
        """Add the drag as damping of surge and sway."""
        if scene.in_water and not scene.head_clamped and values[0] > 0:
            for joint in ("surge", "sway"):
                damping = np.array(spec.joint(joint).damping)
                damping[0] = values[0]
                spec.joint(joint).damping = damping


class SkinFriction(WaterEffect):
    """Friction of a laminar boundary layer on both sides of head and tail, which quadratic drag does not hold.

    One at the parameter 1 is that of a smooth flat plate as long as the fish; a wavy motion thins the layer (Ehrenstein
    and Eloy 2013), and roughness adds to it.
    """

    name = "skin_friction"
    physics = "Drag 1/2 rho S U^2 c with c = 1.328 / sqrt(Re): it grows as U^1.5, so that slow swimmers pay more."
    source = "Blasius; Gazzola, Argentina and Mahadevan, Nature Physics 10 (2014); Ehrenstein and Eloy, JFM 718 (2013)."
    parameters = (Parameter("times_plate", "1", 0.0, 60.0, 2.0),)

    def force(self, robot: RobotSpec, scene: Scene, values: np.ndarray) -> StepForce | None:
        """Return the friction, as a force along the head."""
        if not scene.in_water or not values.any():
            return None
        plates = Plates(robot, scene)
        wetted_m2 = 2 * (4 * plates.half_m[:, 0] * plates.half_m[:, 2]).sum()
        length_m, water = 2 * plates.half_m[:, 0].sum(), robot.water
        kinematic = water.viscosity_pa_s / water.density_kg_m3
        factor = 0.5 * water.density_kg_m3 * wetted_m2 * 1.328 * np.sqrt(kinematic / length_m)
        return _AlongTheHead(plates, lambda speed: factor * values[:, 0] * speed**1.5)


class _AlongTheHead:
    """A resistance along the head's axis: a force in N by the speed there in m/s, of all simulations (n,)."""

    def __init__(self, plates: Plates, resistance: Callable[[np.ndarray], np.ndarray]) -> None:
        self.plates, self.resistance = plates, resistance

    @np.errstate(over="ignore", invalid="ignore")  # a simulation that blows up is marked later
    def __call__(self, state: StepState) -> np.ndarray:
        motion = state.motion
        head = motion.along[:, 0]
        speed = np.real(head.conj() * motion.velocity[:, 0])
        force = np.zeros_like(motion.place)
        force[:, 0] = -np.sign(speed) * self.resistance(np.abs(speed)) * head
        return self.plates.generalised(force, motion)


EFFECTS: tuple[Effect, ...] = (
    AddedMassReaction(),
    SegmentCoefficients(),
    FluidMemory(),
    BackgroundCurrent(),
    WallProximity(),
    WaveDrag(),
    LinearDrag(),
    SkinFriction(),
    SurfaceMotion(),
    HullRoll(),
)
