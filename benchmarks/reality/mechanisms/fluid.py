"""Mechanisms of the water."""

from dataclasses import field, replace

import numpy as np

from benchmarks.reality.camera import Sight
from benchmarks.reality.fluid import Flow, StripForces, Water
from benchmarks.reality.instant import Instant
from benchmarks.reality.layout import Layout
from benchmarks.reality.mechanism import AtStrength, Mechanism
from benchmarks.reality.parameters import Parameters
from swimcal.robot import RobotSpec, load_robot


class MovingWater(Mechanism):
    """Base of moving water: quasi-steady forces are those of the strips' motion relative to the water around them."""

    def velocity(self, place_m: np.ndarray) -> np.ndarray:
        """Return the (n, s) velocity at places in the pool, over the current everywhere; complex, m/s and m."""
        raise NotImplementedError

    def water(self, now: Instant, forces: StripForces, state: np.ndarray) -> StripForces:  # noqa: ARG002
        """Add what changes in the quasi-steady forces."""
        strips, pose = now.layout.strips, now.pose
        direction = pose.direction[:, strips.link]
        relative = self.velocity(pose.origin_m[:, strips.link] + strips.place_m * direction) * direction.conj()
        flow = Flow(now.flow.along_m_s - relative.real, now.flow.across_m_s - relative.imag, now.flow.rate_rad_s)
        moved, still = Water(now.layout, now.parameters, now.chain).forces(flow), now.water
        return forces.plus(
            moved.along_n - still.along_n, moved.across_n - still.across_n, moved.torque_n_m - still.torque_n_m
        )


class AddedMassReaction(Mechanism):
    """Elongated body theory's reactive force, of strips with pi rho h^2 a length but for the ends of the body.

    See `ReactiveWater`. The theory takes the body for endless. Around an end water escapes, and less of
    it is accelerated: the loss falls off over a half height (Newman, Marine Hydrodynamics, 1977, on slender bodies:
    strips hold some diameters from the ends).
    """

    share: float  # share of the theory, 0 to 1
    lost: float = 0.0  # share of that which is lost at the very ends

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:
        """Set another share, less at the ends."""
        strips = layout.strips
        along_m = np.cumsum(strips.length_m) - strips.length_m / 2
        from_end_m = np.minimum(along_m, strips.length_m.sum() - along_m)
        share = self.share * (1 - self.lost * np.exp(-from_end_m / strips.half_height_m))
        return replace(parameters, added_mass_reaction=np.zeros_like(parameters.added_mass_reaction) + share)


def added_mass_reaction(random: np.random.Generator) -> AtStrength:
    """Draw a loss at the ends; a fifth of the theory at strength 1, at which the speed stays; saturates at all of it.

    Draws how much is lost at the ends.
    """
    share = 0.2
    lost = random.uniform(0.2, 0.6)
    return lambda strength: (AddedMassReaction(1 - (1 - share) ** strength, lost),)


class SegmentCoefficients(Mechanism):
    """The five coefficients of keel and fin, each by a factor of its own: drag and lift depend on shape unequally."""

    # ln_head, ln_fin: (5,) ln of the factors on blunt, slender and angular drag, Kutta and Magnus lift
    ln_head: tuple[float, ...]
    ln_fin: tuple[float, ...]

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:
        """Scale the coefficients of the first plate and the last."""
        plate = layout.strips.plate
        ln = np.outer(self.ln_head, plate == plate[0]) + np.outer(self.ln_fin, plate == plate[-1])
        return replace(parameters, coefficients=parameters.coefficients * np.exp(ln))


def segment_coefficients(random: np.random.Generator) -> AtStrength:
    """Draw any mix of head and fin, more or less of either, by e^0.3 at strength 1; saturates at e^2."""
    ln, most_ln, uneven = 0.3, 2.0, 0.07
    angle = random.uniform(0.0, 2 * np.pi)
    head, fin = np.outer([np.cos(angle), np.sin(angle)], np.ones(5)) * (1 + uneven * random.standard_normal((2, 5)))

    def at(strength: float) -> tuple[Mechanism, ...]:
        size = most_ln * np.tanh(ln * strength / most_ln)
        return (SegmentCoefficients(tuple(size * head), tuple(size * fin)),)

    return at


_WAGNER = ((0.165, 0.0455), (0.335, 0.3))
"""Share held back and fading per semichord travelled: R. T. Jones, NACA report 681 (1940), of Wagner's function."""


class FluidMemory(Mechanism):
    """Wagner's indicial response of every strip's forces: half at once, the rest as the wake is left behind.

    One wake trails the whole fish: it fades with the way that the surface has travelled on the mean, so a fast fish
    forgets sooner than a slow one.
    """

    semichord_m: float  # unit of that way

    def start(self, now: Instant) -> np.ndarray:
        """Return (n, 6 s + 1) forces as each of the two wakes holds them, no motion having changed yet; a step, s."""
        return np.concatenate([_stack(now.water)] * len(_WAGNER) + [np.zeros((len(now.time_s), 1))], axis=1)

    def advance(self, now: Instant, state: np.ndarray, step_s: float) -> np.ndarray:
        """Replace what the wakes held by the forces of now."""
        late = self._compute_late(now, state, step_s)
        step = np.full((len(state), 1), step_s)
        return np.concatenate([np.tile(_stack(now.water), len(_WAGNER)) - late, step], axis=1)

    def water(self, now: Instant, forces: StripForces, state: np.ndarray) -> StripForces:
        """Subtract what the wakes hold back, a step after they were left."""
        late = np.split(self._compute_late(now, state, state[:, -1:]), len(_WAGNER), axis=1)
        held = np.asarray(sum(share * each for (share, _), each in zip(_WAGNER, late, strict=True)))
        return forces.plus(*np.split(-held, 3, axis=1))

    def _compute_late(self, now: Instant, state: np.ndarray, step_s: float | np.ndarray) -> np.ndarray:
        """Return (n, 6 s) forces less those in the wakes after a step; exact for forces and speeds that last."""
        area = now.layout.strips.half_height_m * now.layout.strips.length_m
        speed = np.hypot(now.flow.along_m_s, now.flow.across_m_s) @ area / area.sum()
        travelled = speed[:, None] * step_s / self.semichord_m
        held = _stack(now.water).shape
        remaining = np.concatenate([np.broadcast_to(np.exp(-f * travelled), held) for _, f in _WAGNER], axis=1)
        return np.asarray(remaining * (np.tile(_stack(now.water), len(_WAGNER)) - state[:, :-1]))


def _stack(forces: StripForces) -> np.ndarray:
    return np.concatenate([forces.along_n, forces.across_n, forces.torque_n_m], axis=1)


def fluid_memory(random: np.random.Generator) -> AtStrength:
    """Draw the way: at 0.25 m/s and strength 1 as much comes late as with half of it 0.05 s late; linear."""
    semichord_m = 0.0012
    semichord = semichord_m * random.uniform(0.8, 1.25)
    return lambda strength: (FluidMemory(semichord * strength),)


class BackgroundCurrent(MovingWater):
    """A steady eddy as wide as the pool, whose middle is far off: velocity i w (z - z_0) at place z."""

    # right_m_s, up_m_s: velocity at the pool's origin
    right_m_s: float
    up_m_s: float
    turning_rad_s: float  # w

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:  # noqa: ARG002
        """Add the velocity that is the same everywhere."""
        return replace(parameters, current_m_s=parameters.current_m_s + self.right_m_s + 1j * self.up_m_s)

    def velocity(self, place_m: np.ndarray) -> np.ndarray:
        """Return the velocity that differs from place to place."""
        return np.asarray(1j * self.turning_rad_s * place_m)


def background_current(random: np.random.Generator) -> AtStrength:
    """Draw 0.015 m/s at the origin at strength 1, to anywhere; the eddy's middle 4 to 10 m away; linear."""
    speed_m_s = 0.015
    angle = random.uniform(0.0, 2 * np.pi)
    right, up = speed_m_s * np.cos(angle), speed_m_s * np.sin(angle)
    turning = random.choice([-1.0, 1.0]) * speed_m_s / random.uniform(4.0, 10.0)
    return lambda strength: ((BackgroundCurrent(strength * right, strength * up, strength * turning),))


_PLATE_DRAG = 1.2  # drag coefficient of a plate held broadside (Hoerner, Fluid-Dynamic Drag, 1965, chapter 3)
_COURSE_S = 1.0  # time constant of the mean heading
_FENDER_N_M2 = 2000.0  # force on a strip that touches the wall, per length and depth of touch


class WallProximity(Mechanism):
    """Image of the fish behind the wall, which speeds the water up in the gap: suction along it, more drag across.

    The image of a strip of half height h at clearance c is a doublet 2 c away, so the water is faster by a share that
    goes as (h / c)^2; here b = h^2 / (2 c^2 + h^2 / 2), of the size that foils near the ground show (Quinn, Lauder and
    Smits, J. Fluid Mech. 742, 2014). With (1 + b)^2 - 1 for the pressures, u along and v towards the wall, it draws by
    1/2 rho S (2 b + b^2) (u^2 c / sqrt(c^2 + h^2) - 1.2 |v| v). It runs along the fish's course, its mean heading of
    the last second or so, and is a fender where the fish touches it.
    """

    side: float  # +1 left, -1 right
    distance_m: float  # distance from the head's origin at the start

    def start(self, now: Instant) -> np.ndarray:
        """Return (n, 2): where the head is, and which way the wall is, complex."""
        return np.concatenate([now.pose.origin_m[:, :1], -1j * self.side * now.pose.direction[:, :1]], axis=1)

    def advance(self, now: Instant, state: np.ndarray, step_s: float) -> np.ndarray:
        """Return the course a step later: the heading, forgotten exponentially."""
        across = -1j * self.side * now.pose.direction[:, :1]
        normal = state[:, 1:] + -np.expm1(-step_s / _COURSE_S) * (across - state[:, 1:])
        return np.concatenate([state[:, :1], normal / np.abs(normal)], axis=1)

    def water(self, now: Instant, forces: StripForces, state: np.ndarray) -> StripForces:
        """Change the forces on every strip by its own clearance."""
        strips = now.layout.strips
        origin, normal = np.split(state, 2, axis=1)
        direction = now.pose.direction[:, strips.link]
        place = now.pose.origin_m[:, strips.link] + strips.place_m * direction
        clear = self.distance_m - ((place - origin) * normal.conj()).real
        moving = (now.flow.along_m_s + 1j * now.flow.across_m_s) * direction * normal.conj()
        height, open_m = strips.half_height_m, np.maximum(clear, 0.0)
        faster = height**2 / (2 * open_m**2 + height**2 / 2)
        drawn_in = moving.imag**2 * open_m / np.hypot(open_m, height) - _PLATE_DRAG * np.abs(moving.real) * moving.real
        pressed = now.parameters.density_kg_m3 * height * strips.length_m * (2 * faster + faster**2)
        fender = _FENDER_N_M2 * strips.length_m * np.minimum(clear, 0.0)
        force = (pressed * drawn_in + fender) * normal * direction.conj()
        return forces.plus(force.real, force.imag)


def wall_proximity(random: np.random.Generator) -> AtStrength:
    """Draw left or right, at about 0.65 m at strength 1, coming nearer with more; never nearer than 0.12 m."""
    nearest_m, at_one_m = 0.12, 0.65
    side, further_m = random.choice([-1.0, 1.0]), (at_one_m - nearest_m) * random.uniform(0.8, 1.25)
    return lambda strength: (WallProximity(side, nearest_m + further_m / strength),)


_GRAVITY_M_S2 = 9.81
_WATERLINE_M = 0.1  # The hull is widest this far behind the head's origin.


class WaveDrag(Mechanism):
    """Drag 1/2 rho S c(Fr) U^2 on the head, c a bell over the logarithm of the Froude number U / sqrt(g L).

    c = c_0 exp(-ln(Fr / Fr_0)^2 / 2 s^2): the envelope of measured hulls, hump and all (Hoerner, Fluid-Dynamic Drag,
    1965, chapter 11), L the length of the keel.
    """

    on_hump: float  # c_0
    hump_froude: float  # Fr_0
    width: float  # s

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """Return the drag against the head's way through the water."""
        robot, direction = now.layout.robot, now.pose.direction[:, :1]
        still = now.parameters.current_m_s
        speed = ((now.pose.velocity_m_s[:, :1] - still) * direction.conj()).real
        froude = np.abs(speed) / np.sqrt(_GRAVITY_M_S2 * 2 * robot.head.fluid_half_size_m[0])
        apart = np.log(np.maximum(froude, 1e-9) / self.hump_froude) / self.width
        pressed = 0.5 * now.parameters.density_kg_m3 * robot.elongated_body.reference_area_m2
        drag = -pressed * self.on_hump * np.exp(-(apart**2) / 2) * np.abs(speed) * speed
        return now.push(0, _WATERLINE_M, drag * direction)


def wave_drag(random: np.random.Generator) -> AtStrength:
    """Draw 0.5 on the hump at strength 1, linear; the hump at Fr 0.48 to 0.52, more or less wide."""
    on_hump = 0.5
    hump, width = random.uniform(0.48, 0.52), random.uniform(0.41, 0.45)
    return lambda strength: (WaveDrag(on_hump * strength, hump, width),)


class LinearDrag(Mechanism):
    """A drag on the hull in proportion to its speed along itself, where it is widest."""

    drag_n_s_m: float

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """Return the drag against the head's way through the water."""
        direction = now.pose.direction[:, :1]
        speed = ((now.pose.velocity_m_s[:, :1] - now.parameters.current_m_s) * direction.conj()).real
        return now.push(0, _WATERLINE_M, -self.drag_n_s_m * speed * direction)


def linear_drag(random: np.random.Generator) -> AtStrength:
    """Draw 0.2 N s/m at strength 1, linear."""
    drag_n_s_m = 0.2 * random.uniform(0.8, 1.25)
    return lambda strength: (LinearDrag(drag_n_s_m * strength),)


class SkinFriction(Mechanism):
    """Friction of a laminar layer on both sides of every strip, thinned by the motion across it.

    0.664 rho u sqrt(nu v / x) on each side of a strip x behind the nose that moves with v in all, u along itself
    (Blasius for a flat plate; that what crosses the body thins the layer: Ehrenstein and Eloy, JFM 716, 2013).
    """

    times: float

    def water(self, now: Instant, forces: StripForces, state: np.ndarray) -> StripForces:  # noqa: ARG002
        """Add friction along each strip."""
        strips, water = now.layout.strips, now.layout.robot.water
        behind_m = np.cumsum(strips.length_m) - strips.length_m / 2
        speed = np.hypot(now.flow.along_m_s, now.flow.across_m_s)
        layer = np.sqrt(water.viscosity_pa_s / water.density_kg_m3 * speed / behind_m)
        area = 2 * 2 * strips.half_height_m * strips.length_m
        pull = -0.664 * self.times * water.density_kg_m3 * area * layer * now.flow.along_m_s
        return forces.plus(pull, np.zeros_like(pull), np.zeros_like(pull))


def skin_friction(random: np.random.Generator) -> AtStrength:
    """Draw twice the friction of a smooth plate at strength 1, linear."""
    times = 2.0 * random.uniform(0.8, 1.25)
    return lambda strength: (SkinFriction(times * strength),)


_MOST_RAD = 0.4


class SurfaceMotion(Mechanism):
    """Roll and pitch as damped oscillators, as of any floating body, driven by the nose's acceleration as it is seen.

    roll'' + 2 z w roll' + w^2 roll = g a, a the acceleration across the head; pitch alike with that along it. Before
    the film they are driven by its mirror image. Markers swing about an axis below them, and come nearer to the camera
    where the body pitches up; in a dry run the head does not move, and nothing swings.
    """

    # roll_per_m, pitch_per_m: g
    roll_per_m: float
    pitch_per_m: float
    # roll_hz, pitch_hz: w / 2 pi
    roll_hz: float
    pitch_hz: float
    damping: float  # z
    draught_m: float  # depth of the axis below the nose's marker
    robot: RobotSpec = field(default_factory=load_robot)  # robot whose markers these are

    def place(self, sight: Sight) -> Sight:
        """Swing the markers."""
        place_m = self.robot.marker_positions_m(sight.names)
        nose = self.robot.markers["nose"]
        head = [self.robot.markers[name].body == "head" for name in sight.names].index(True)
        above = place_m[:, 2] - nose.position_m[2] + self.draught_m
        time_s, frame = np.unique(sight.time_s.round(6), return_index=True)  # a frame may be seen twice
        axis = sight.axis[frame, head]
        nose_m = sight.marker_m[frame, head] - (place_m[head, 0] - nose.position_m[0]) * axis
        pushed = np.gradient(np.gradient(nose_m, time_s), time_s) * axis.conj()
        roll, pitch = (
            np.interp(sight.time_s, time_s, _MOST_RAD * np.tanh(self._swing(time_s, driven, hz) / _MOST_RAD))
            for driven, hz in (
                (self.roll_per_m * pushed.imag, self.roll_hz),
                (self.pitch_per_m * pushed.real, self.pitch_hz),
            )
        )
        along = sight.axis[:, head]
        lean = (np.sin(pitch) - 1j * np.sin(roll)) * along
        astern = ((sight.marker_m - sight.marker_m[:, head : head + 1]) * along[:, None].conj()).real
        astern = astern + place_m[head, 0] - self.robot.head.fluid_centre_m[0]
        return replace(
            sight,
            marker_m=sight.marker_m + above * lean[:, None],
            height_m=sight.height_m - np.sin(pitch)[:, None] * astern,
        )

    def _swing(self, time_s: np.ndarray, driven: np.ndarray, hz: float) -> np.ndarray:
        """Return (f,) angles at times (f,), by Newmark's mean acceleration; from rest a film's length before."""
        frames = len(time_s)
        time_s = np.concatenate([2 * time_s[0] - time_s[:0:-1], time_s])
        driven = np.concatenate([driven[:0:-1], driven])
        damping, stiffness = 4 * np.pi * self.damping * hz, (2 * np.pi * hz) ** 2
        angle, rate, gain = np.zeros(len(time_s)), 0.0, 0.0
        for k, h in enumerate(np.diff(time_s), start=1):
            ahead, faster = angle[k - 1] + h * rate + h**2 / 4 * gain, rate + h / 2 * gain
            gain = (driven[k] - damping * faster - stiffness * ahead) / (1 + damping * h / 2 + stiffness * h**2 / 4)
            angle[k], rate = ahead + h**2 / 4 * gain, faster + h / 2 * gain
        return angle[-frames:]


def surface_motion(random: np.random.Generator) -> AtStrength:
    """Draw some 0.05 rad of either at 1 Hz at strength 1; saturates at 0.4 rad."""
    roll_per_m, pitch_per_m = 3.5, 6.0  # angular acceleration over the nose's, 1/m
    roll = roll_per_m * random.choice([-1.0, 1.0]) * random.uniform(0.7, 1.4)
    pitch = pitch_per_m * random.choice([-1.0, 1.0]) * random.uniform(0.7, 1.4)
    roll_hz, pitch_hz = random.uniform(1.9, 2.1), random.uniform(1.5, 1.7)
    damping, draught = random.uniform(0.18, 0.22), random.uniform(0.0, 0.003)
    return lambda strength: ((SurfaceMotion(strength * roll, strength * pitch, roll_hz, pitch_hz, damping, draught),))


def hull_roll(random: np.random.Generator) -> AtStrength:
    """Draw a soft roll about an axis well below the markers, its frequency near the beat; saturates at 0.4 rad."""
    roll_per_m = 5.0 * random.choice([-1.0, 1.0]) * random.uniform(0.7, 1.4)
    roll_hz, damping, axis_m = random.uniform(0.42, 0.8), random.uniform(0.16, 0.25), random.uniform(0.035, 0.065)
    return lambda strength: (SurfaceMotion(strength * roll_per_m, 0.0, roll_hz, 1.6, damping, axis_m),)
