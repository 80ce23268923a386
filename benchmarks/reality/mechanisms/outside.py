"""Mechanisms that the catalogue of effects does not hold."""

from dataclasses import replace

import numpy as np

from benchmarks.reality.camera import Sight
from benchmarks.reality.fluid import StripForces
from benchmarks.reality.instant import Instant
from benchmarks.reality.mechanism import AtStrength, Mechanism, Wearing
from benchmarks.reality.mechanisms.drive import LateCrank
from benchmarks.reality.mechanisms.fluid import MovingWater

_SLOW_M_S = 0.1


class LooseningMarker(Wearing):
    """Marker that slides tailwards out of its socket, ever more slowly, and lags in it when the tail sweeps."""

    which: float  # 0 to 1, of all markers but nose and neck
    slide_m: float  # distance slid in the end
    slide_s: float  # time in which two thirds of it are done
    wobble_m: float  # largest lag

    def place(self, sight: Sight) -> Sight:
        """Move the one marker."""
        loose = [i for i, name in enumerate(sight.names) if name not in ("nose", "neck")]
        if not loose:
            return sight
        marker = loose[int(self.which * len(loose))]
        time_s, frame, seen = np.unique(sight.time_s.round(6), return_index=True, return_inverse=True)
        place_m, axis = sight.marker_m[:, marker], sight.axis[:, marker]
        sweep = (np.gradient(place_m[frame], time_s)[seen] * axis.conj()).imag
        slid = -self.slide_m * np.expm1(-(self.before_s + sight.time_s) / self.slide_s)
        moved = sight.marker_m.copy()
        moved[:, marker] += (slid - 1j * self.wobble_m * np.tanh(sweep / _SLOW_M_S)) * axis
        return replace(sight, marker_m=moved)


def loosening_marker(random: np.random.Generator) -> AtStrength:
    """Draw any but nose and neck; 4 mm of slide are mixed with 3 mm of wobble at strength 1; linear."""
    slide_m, wobble_m = 0.004, 0.003
    which, mix, slide_s = random.random(), random.random(), random.uniform(3.0, 30.0)
    return lambda strength: (
        (LooseningMarker(which, (1 - mix) * slide_m * strength, slide_s, mix * wobble_m * strength),)
    )


_RATE_HZ = 0.4  # Glitches come at this mean rate at strength 1.
_MEAN_FRAMES = 1.5  # A glitch lasts this many frames on the mean.


class TimingGlitch(Mechanism):
    """Picture that now and then freezes for some frames, or skips some; all that follows is late, or early."""

    rate_hz: float  # rate of glitches
    # Seed of when they come and how long they last. They are others in trials of another length; those at a low rate
    # come at a higher one too.
    seed: int

    def expose(self, time_s: np.ndarray) -> np.ndarray:
        """Return times as many frames off as have been lost or gained so far."""
        random, frames = np.random.default_rng([self.seed, len(time_s)]), len(time_s)
        step = np.diff(time_s, prepend=time_s[:1])
        rare, skips = random.random(frames), random.random(frames) < 0.5
        lasts = random.geometric(1 / _MEAN_FRAMES, frames)
        struck = np.flatnonzero(rare < -np.expm1(-self.rate_hz * step))
        shown = step.copy()
        for k in struck[skips[struck]]:
            shown[k] += lasts[k] * step[k]
        for k in struck[~skips[struck]]:
            shown[k : k + lasts[k]] = 0.0
        return time_s + np.cumsum(shown - step)


def timing_glitch(random: np.random.Generator) -> AtStrength:
    """Draw a glitch in 2.5 s at strength 1, of one or two frames; as often again with every further 1."""
    seed = int(random.integers(2**31))
    return lambda strength: (TimingGlitch(_RATE_HZ * strength, seed),)


_LAG_S = 0.02


class SlippingCoupling(LateCrank):
    """Crank that turns back against the motor wherever the torque through the coupling is more than that holds.

    The rate at which it loses angle lags a little behind the torque.
    """

    holds_n_m: float  # torque without slip
    slip_rad_n_m_s: float  # rate of the slip over the torque beyond

    def advance(self, now: Instant, state: np.ndarray, step_s: float) -> np.ndarray:
        """Advance the slip by the torque of the moment."""
        _, lost, slip = np.split(state, 3, axis=1)
        torque = now.pull.crank_torque_n_m
        steady = self.slip_rad_n_m_s * np.sign(torque) * np.maximum(np.abs(torque) - self.holds_n_m, 0.0)
        slower = steady + np.exp(-step_s / _LAG_S) * (slip - steady)
        return np.concatenate([now.time_s + step_s, lost + slip * step_s, slower], axis=1)


def slipping_coupling(random: np.random.Generator) -> AtStrength:
    """Draw a limit of 0.3 to 0.6 N m; the rate of the slip is linear in the strength."""
    slip_rad_n_m_s = 0.15
    holds = random.uniform(0.3, 0.6)
    return lambda strength: (SlippingCoupling(holds, slip_rad_n_m_s * strength),)


class CreepingTendon(Wearing):
    """Knots that settle: after t in use the free length of one tendon has grown by g t / (t + t_half)."""

    half_s: float  # t_half
    # left_m, right_m: g
    left_m: float
    right_m: float

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """Lower the tension."""
        in_use_s = np.maximum(self.before_s + now.time_s, 0.0)
        used = in_use_s / (in_use_s + self.half_s)
        grown = np.concatenate([self.left_m * used, self.right_m * used], axis=1)
        return now.tighten(-now.parameters.tendon_stiffness_n_m * grown)


def creeping_tendon(random: np.random.Generator) -> AtStrength:
    """Draw left or right; 1 mm in the end at strength 1, half of it in the first 3 to 10 s; saturates at 8 mm."""
    creep_m, most_m = 0.001, 0.008
    left, half_s = random.random() < 0.5, random.uniform(3.0, 10.0)
    shares = np.array([left, not left])
    return lambda strength: (CreepingTendon(half_s, *(most_m * np.tanh(creep_m * strength / most_m) * shares)),)


class CrackedSegment(Wearing):
    """Gap that loses a share of its stiffness from one moment on, within a few beats, as a crack runs through it."""

    gap: float  # index of the robot's hinge
    lost: float  # share of its stiffness
    cracks_s: float  # time in use, from the session's beginning, when half of that is lost
    runs_s: float  # time that the crack takes to run, over 4

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """Take back what the spring no longer exerts."""
        cracked = 0.5 * (1 + np.tanh((self.before_s + now.time_s - self.cracks_s) / (2 * self.runs_s)))
        spring = now.parameters.hinge_stiffness_n_m * (now.pose.hinge_rad - now.parameters.hinge_rest_rad)
        return now.bend(self.lost * cracked * (now.layout.gap_of_hinge == self.gap) * spring)


def cracked_segment(random: np.random.Generator) -> AtStrength:
    """Draw one of the front gaps, 0.5 to 2 s after the beginning; it loses a third at strength 1, nearly all at 20."""
    ln = 0.4
    loaded = 3  # gaps, from the head on, that bear most
    gap, cracks_s, runs_s = float(random.integers(loaded)), random.uniform(0.5, 2.0), random.uniform(0.1, 0.4)
    return lambda strength: ((CrackedSegment(gap, float(-np.expm1(-ln * strength)), cracks_s, runs_s),))


class WaterInHull(Mechanism):
    """A mass on a spring and a damper, as sloshing is modelled (Dodge, NASA SP-106, 2000, chapter 3), in the head.

    Its weight comes on top of the robot's.
    """

    mass_kg: float  # mass that takes part
    slosh_hz: float  # frequency in a hull at rest
    damping: float  # damping ratio
    place_m: float  # place of the hull's middle in the head's axes

    def start(self, now: Instant) -> np.ndarray:
        """Return (n, 2) place and velocity, complex: it moves with the hull."""
        return np.concatenate(self._locate_hull(now), axis=1)

    def advance(self, now: Instant, state: np.ndarray, step_s: float) -> np.ndarray:
        """Take a leapfrog step."""
        faster = state[:, 1:] + self._compute_pull(now, state) / self.mass_kg * step_s
        return np.concatenate([state[:, :1] + faster * step_s, faster], axis=1)

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:
        """Return the force on the hull."""
        return now.push(0, self.place_m, -self._compute_pull(now, state))

    def _locate_hull(self, now: Instant) -> tuple[np.ndarray, np.ndarray]:
        arm = self.place_m * now.pose.direction[:, :1]
        return now.pose.origin_m[:, :1] + arm, now.pose.velocity_m_s[:, :1] + 1j * now.pose.rate_rad_s[:, :1] * arm

    def _compute_pull(self, now: Instant, state: np.ndarray) -> np.ndarray:
        """Return the (n, 1) force on the water, complex."""
        place, velocity = self._locate_hull(now)
        rate = 2 * np.pi * self.slosh_hz
        off, faster = state[:, :1] - place, state[:, 1:] - velocity
        return np.asarray(-self.mass_kg * (rate**2 * off + 2 * self.damping * rate * faster))


def water_in_hull(random: np.random.Generator) -> AtStrength:
    """Draw 50 g at strength 1, linear, sloshing at 0.8 to 2 Hz somewhere in the head."""
    kg = 0.05
    slosh_hz, damping, place = random.uniform(0.8, 2.0), random.uniform(0.03, 0.2), random.uniform(0.0, 0.2)
    return lambda strength: (WaterInHull(kg * strength, slosh_hz, damping, place),)


class CamberedFin(Mechanism):
    """Lift 1/2 rho S C |v|^2 across the fin's way through water, at any angle of attack: a thin aerofoil's camber."""

    # C, 4 pi times the camber over the chord (Anderson, Fundamentals of Aerodynamics, section 4.8). A positive one
    # pushes a fin that moves ahead to the right.
    lift: float

    def water(self, now: Instant, forces: StripForces, state: np.ndarray) -> StripForces:  # noqa: ARG002
        """Add lift to the last plate; it does no work."""
        strips, flow = now.layout.strips, now.flow
        area = np.where(strips.plate == strips.plate[-1], 2 * strips.half_height_m * strips.length_m, 0.0)
        pressed = 0.5 * now.parameters.density_kg_m3 * area * self.lift * np.hypot(flow.along_m_s, flow.across_m_s)
        return forces.plus(pressed * flow.across_m_s, -pressed * flow.along_m_s)


def cambered_fin(random: np.random.Generator) -> AtStrength:
    """Draw lift to either side; a coefficient of about 0.1 at strength 1, linear."""
    lift = 0.1 * random.choice([-1.0, 1.0]) * random.uniform(0.7, 1.4)
    return lambda strength: (CamberedFin(lift * strength),)


_STROUHAL = 0.2  # Roshko, NACA report 1191 (1954)
_LINES = np.array([-0.31, -0.17, -0.06, 0.04, 0.15, 0.33])  # lines of the spectrum about the Strouhal frequency
# These turn one drawn number into phases that look drawn each.
_PHASE_FACTORS = np.sqrt([2.0, 3.0, 5.0, 7.0, 11.0, 13.0])
_LEAST_M_S = 0.02


class VortexBuffeting(Mechanism):
    """A side force on the fin with lines about f = 0.2 U / D, so that it beats irregularly; no two trials alike."""

    lift: float  # root mean square of the force over 1/2 rho S U^2, S the fin's area
    width_m: float  # D, width of what sheds
    luck: float  # number of 0 to 1 that sets the phases of the lines

    def start(self, now: Instant) -> np.ndarray:
        """Return (n, 1) widths travelled, from a beginning that another place or crank changes."""
        origin = now.pose.origin_m[:, :1]
        return 1e3 * (np.abs(np.sin(now.turn.angle_rad + now.turn.speed_rad_s)) + np.abs(origin.real + 2 * origin.imag))

    def advance(self, now: Instant, state: np.ndarray, step_s: float) -> np.ndarray:
        """Advance the widths travelled with the head."""
        return np.asarray(state + self._measure_speed(now) * step_s / self.width_m)

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:
        """Return the force across the fin, at its middle."""
        robot, direction = now.layout.robot, now.pose.direction[:, -1:]
        fin = robot.caudal_fin
        phase = 2 * np.pi * (_STROUHAL * (1 + _LINES) * state + 100 * self.luck * _PHASE_FACTORS)
        pressed = 0.5 * now.parameters.density_kg_m3 * fin.chord_m * fin.span_m * self._measure_speed(now) ** 2
        side = self.lift * pressed * np.cos(phase).sum(axis=1, keepdims=True) * np.sqrt(2 / len(_LINES))
        behind = robot.fin_root_x_m + fin.centre_m - now.layout.origin_m[-1]
        return now.push(now.layout.hinges, behind, 1j * side * direction)

    def _measure_speed(self, now: Instant) -> np.ndarray:
        return np.hypot(np.abs(now.pose.velocity_m_s[:, :1] - now.parameters.current_m_s), _LEAST_M_S)


def vortex_buffeting(random: np.random.Generator) -> AtStrength:
    """Draw a lift coefficient of 0.5 at strength 1, linear; shed by something 20 to 80 mm wide."""
    lift = 0.5
    width, luck = random.uniform(0.02, 0.08), random.random()
    return lambda strength: (VortexBuffeting(lift * strength, width, luck),)


_SHARPNESS = 8.0  # A larger number makes the bubble come and go more abruptly.


class TrappedBubble(Mechanism):
    """Drag k |v| v at one place on the keel for part of every stretch of a swim: it grows, tears off, grows again."""

    drag_kg_m: float  # k
    period_s: float  # time between two bubbles
    part: float  # share of the period in which there is one
    begins: float  # share of the first period after which it begins
    place_m: float  # place on the keel, in the head's axes

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """Return the drag on the head, in water."""
        swing = np.cos(2 * np.pi * (now.time_s / self.period_s - self.begins)) - np.cos(np.pi * self.part)
        wet = now.parameters.density_kg_m3 > 0
        drag = self.drag_kg_m * wet * 0.5 * (1 + np.tanh(_SHARPNESS * swing))
        arm = self.place_m * now.pose.direction[:, :1]
        velocity = now.pose.velocity_m_s[:, :1] + 1j * now.pose.rate_rad_s[:, :1] * arm - now.parameters.current_m_s
        return now.push(0, self.place_m, -drag * np.abs(velocity) * velocity)


def trapped_bubble(random: np.random.Generator) -> AtStrength:
    """Draw every 1.5 to 4 s, there a third to two thirds of the time; 0.25 kg/m at strength 1, linear."""
    drag_kg_m = 0.25
    period, part, begins = random.uniform(1.5, 4.0), random.uniform(0.33, 0.67), random.random()
    place = random.uniform(-0.05, 0.25)
    return lambda strength: (TrappedBubble(drag_kg_m * strength, period, part, begins, place),)


class Propwash(MovingWater):
    """A plane jet that lasts: velocity U exp(-(d / b)^2) along its line, d the distance from that.

    The Gaussian profile of Rajaratnam, Turbulent Jets (1976), chapter 1, without the slow widening.
    """

    speed_m_s: float  # U, on the line
    heading_rad: float  # heading of the jet in the pool
    offset_m: float  # distance of its line from the pool's origin, to its left
    width_m: float  # b

    def velocity(self, place_m: np.ndarray) -> np.ndarray:
        """Return the velocity of the jet."""
        along = np.exp(1j * np.asarray(self.heading_rad))
        apart = ((place_m * along.conj()).imag - self.offset_m) / self.width_m
        return np.asarray(self.speed_m_s * np.exp(-(apart**2)) * along)


def propwash(random: np.random.Generator) -> AtStrength:
    """Draw a jet 0.2 to 0.5 m wide, its line within 0.2 m of the origin; 0.015 m/s at strength 1, linear."""
    speed_m_s = 0.015
    heading, offset = random.uniform(0.0, 2 * np.pi), random.uniform(-0.2, 0.2)
    width = random.uniform(0.2, 0.5)
    return lambda strength: (Propwash(speed_m_s * strength, heading, offset, width),)


_STRAIGHT = 0.05  # A cable that is all paid out has this sag over span.


class Tether(Mechanism):
    """Sagging cable that pulls harder the further off its post is, and is dragged along sideways through the water.

    A parabola of span d and length l sags by f^2 = 3 d (l - d) / 8 and pulls by w d^2 / 8 f (Irvine, Cable Structures,
    1981, section 2.2), with w its weight in water per length.
    """

    # post_x_m, post_y_m: place of the post in the pool
    post_x_m: float
    post_y_m: float
    length_m: float  # l
    weight_n_m: float  # w
    drag_kg_m: float  # force over the head's speed squared

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """Return the pull on the head's origin."""
        away = self.post_x_m + 1j * self.post_y_m - now.pose.origin_m[:, :1]
        span = np.abs(away)
        sag = np.sqrt(3 / 8 * span * np.maximum(self.length_m - span, 0.0) + (_STRAIGHT * span) ** 2 + 1e-9)
        pull = self.weight_n_m * span**2 / (8 * sag) * away / (span + 1e-9)
        velocity = now.pose.velocity_m_s[:, :1]
        return now.push(0, 0.0, pull - self.drag_kg_m * np.abs(velocity) * velocity)


def tether(random: np.random.Generator) -> AtStrength:
    """Draw a post 1.5 to 2.5 m off, 3 m of cable; weight and drag are linear in the strength."""
    weight_n_m, drag_kg_m = 0.04, 0.05
    post = random.uniform(1.5, 2.5) * np.exp(1j * random.uniform(0.0, 2 * np.pi))
    weight, drag = weight_n_m * random.uniform(0.7, 1.4), drag_kg_m * random.uniform(0.5, 2.0)
    return lambda strength: ((Tether(float(post.real), float(post.imag), 3.0, strength * weight, strength * drag),))
