"""The twin's formulas as mechanisms of reality: what its own forms are held against, in one and the same simulator.

For each effect but those of camera and tracker, mechanisms by the twin's parameters and typical values of these. An
effect that is new in the catalogue needs an entry here: what its form in `swimcal/effects` says, on reality's bodies.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from benchmarks.reality.fluid import StripForces
from benchmarks.reality.instant import Instant
from benchmarks.reality.layout import Layout
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms.drive import DriveRatioError, MotorStartDelay
from benchmarks.reality.mechanisms.fluid import (
    AddedMassReaction,
    BackgroundCurrent,
    SegmentCoefficients,
    SurfaceMotion,
    WallProximity,
    _stack,
)
from benchmarks.reality.mechanisms.structure import EntrainedWater, StiffnessError
from benchmarks.reality.mechanisms.tendons import (
    CrankArmError,
    TendonAsymmetry,
    TendonCompliance,
    _mark_behind,
    _mark_strung,
    _measure_arms_m,
    _measure_straight_arms_m,
)
from benchmarks.reality.parameters import Parameters
from benchmarks.reality.tendons import Turn
from swimcal.effects.drive import LatePace, WarmingPace
from swimcal.effects.structure import CREEP_RAD_S
from swimcal.effects.tendons import CREEP_M_S
from swimcal.effects.water import (
    AT_ONCE,
    DAMPING,
    DRAG,
    LIFT,
    NATURAL_ROLL_HZ,
    PITCH_HZ,
    ROLL_HZ,
    SLOW_M_S,
    wave_drag_ratio,
)

_BENT_RAD = 0.5  # up to which a hardening hinge is taken implicitly


class TwinsForm(NamedTuple):
    """A formula of the twin's.

    Attributes:
        of: mechanisms by the values of its parameters.
        typical: values.
    """

    of: Callable[..., Mechanism]
    typical: tuple[float, ...]


class Sag(Mechanism):
    """f / (1 + load f^2), and falling as the winding warms."""

    load: float
    warming: float

    def turn(self, time_s: np.ndarray, turn: Turn, state: np.ndarray) -> Turn:  # noqa: ARG002
        pace, kept = WarmingPace(self.warming), 1 / (1 + self.load * (turn.speed_rad_s / (2 * np.pi)) ** 2)
        running = np.maximum(time_s, 0.0)
        reached = np.minimum(time_s, 0.0) * pace.rate(0.0 * running) + pace.reached_s(running)
        angle = turn.angle_rad + turn.speed_rad_s * (kept * reached - time_s)
        return Turn(angle, turn.speed_rad_s * kept * pace.rate(running))


class Ripple(Mechanism):
    """Twice a turn, by as many turns a second at any speed."""

    cosine_hz: float
    sine_hz: float

    def turn(self, time_s: np.ndarray, turn: Turn, state: np.ndarray) -> Turn:  # noqa: ARG002
        hz, twice = turn.speed_rad_s / (2 * np.pi), 2 * turn.angle_rad
        ahead = (self.cosine_hz * np.sin(twice) - self.sine_hz * np.cos(twice)) / (2 * hz)
        faster = (self.cosine_hz * np.cos(twice) + self.sine_hz * np.sin(twice)) / hz
        return Turn(turn.angle_rad + ahead, turn.speed_rad_s * (1 + faster))


class LateStart(Mechanism):
    """Up to speed by a smooth step; before the film as reality's own, which has a run-in and the twin has none."""

    delay_s: float

    def turn(self, time_s: np.ndarray, turn: Turn, state: np.ndarray) -> Turn:
        before = MotorStartDelay(self.delay_s, 1e-6).turn(np.minimum(time_s, 0.0), turn, state)
        pace, running = LatePace(self.delay_s), np.maximum(time_s, 0.0)
        angle = turn.angle_rad - turn.speed_rad_s * (time_s - pace.reached_s(running))
        return Turn(
            np.where(time_s < 0, before.angle_rad, angle),
            np.where(time_s < 0, before.speed_rad_s, turn.speed_rad_s * pace.rate(running)),
        )


class Slack(Mechanism):
    """A dead band with sharp edges, in which a line is damped by the share of it that drags."""

    length_m: float
    dragging_m: float

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:  # noqa: ARG002
        stretch, p, slack_m = now.pull.stretch_m, now.parameters, self.length_m + self.dragging_m
        held = np.maximum(stretch - slack_m, 0.0) + np.minimum(stretch + slack_m, 0.0)
        damping = p.tendon_damping_n_s_m * np.where(np.abs(stretch) > slack_m, 1.0, self.dragging_m / slack_m)
        return now.tighten(p.tendon_stiffness_n_m * held + damping * now.pull.rate_m_s - now.pull.tension_n)


class GuideFriction(Mechanism):
    """F u / sqrt(u^2 + creep^2) of both lines at every guide."""

    force_n: float

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:
        arms = np.abs(_measure_straight_arms_m(layout))
        bound = sum(2 * arms * behind * (arms @ behind) for behind in _mark_behind(layout))
        more = self.force_n / CREEP_M_S * bound * _mark_strung(parameters)
        return parameters.taken_implicitly(damping=more)

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:  # noqa: ARG002
        arms, behind = _measure_arms_m(now), _mark_behind(now.layout)
        speed = (arms * now.pose.hinge_rate_rad_s[:, None]) @ behind.T  # (n, 2, g)
        friction = (
            np.reshape(self.force_n * _mark_strung(now.parameters), (-1, 1, 1)) * speed / np.hypot(speed, CREEP_M_S)
        )
        return now.bend(-((friction @ behind) * arms).sum(axis=1))


class HingeFriction(Mechanism):
    """T w / sqrt(w^2 + creep^2) of each gap; its hinges, in series, share its rate."""

    torque_n_m: float

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:
        more = self.torque_n_m * layout.hinges_per_gap / CREEP_RAD_S
        return parameters.taken_implicitly(damping=more)

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:  # noqa: ARG002
        rate = now.pose.hinge_rate_rad_s
        return now.bend(-self.torque_n_m * rate / np.hypot(rate, CREEP_RAD_S / now.layout.hinges_per_gap))


class Cubic(Mechanism):
    """k q (1 + cubic q^2) of each gap."""

    cubic: float

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:  # noqa: ARG002
        more = 3 * self.cubic * _BENT_RAD**2 * parameters.hinge_stiffness_n_m
        return parameters.taken_implicitly(more)

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:  # noqa: ARG002
        bent = now.pose.hinge_rad - now.parameters.hinge_rest_rad
        steeper = self.cubic * now.layout.hinges_per_gap**2
        return now.bend(-steeper * now.parameters.hinge_stiffness_n_m * bent**3)


class Damping(Mechanism):
    """All hinges alike."""

    relative: float

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:  # noqa: ARG002
        return replace(parameters, hinge_damping_n_m_s=parameters.hinge_damping_n_m_s * (1 + self.relative))


class Bend(Mechanism):
    """All hinges at one angle."""

    angle_rad: float

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:
        rest = parameters.hinge_rest_rad + self.angle_rad / layout.hinges_per_gap
        return replace(parameters, hinge_rest_rad=rest)


class TailMass(Mechanism):
    """Spread as the tail's own, on the last segment, and in the middle of the fin."""

    share: float
    on_last: float
    on_fin: float

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:
        kg = parameters.link_mass_kg[0]
        heavier = np.full(len(kg), 1 + self.share * kg[0] / kg[1:].sum())
        heavier[0] = 1 - self.share - self.on_last - self.on_fin
        last, robot = np.array([layout.hinges] * 2), layout.robot
        fin_m = robot.fin_root_x_m + robot.caudal_fin.centre_m - layout.origin_m[-1]
        plate_m = (robot.fin_root_x_m - layout.origin_m[-1]) / 2
        lumps = layout.on_links(last, np.array([self.on_last, self.on_fin]) * kg[0], np.array([plate_m, fin_m]))
        return parameters.reweighed(heavier, lumps)


class OneWake(Mechanism):
    """Half of the forces comes late, by one exponential of the way."""

    way_m: float

    def start(self, now: Instant) -> np.ndarray:
        return _stack(now.water)

    def advance(self, now: Instant, state: np.ndarray, step_s: float) -> np.ndarray:
        area = now.layout.strips.half_height_m * now.layout.strips.length_m
        speed = np.hypot(now.flow.along_m_s, now.flow.across_m_s) @ area / area.sum()
        left = np.exp(-np.hypot(speed, SLOW_M_S)[:, None] * step_s / self.way_m)
        water = _stack(now.water)
        return np.asarray(water + left * (state - water))

    def water(self, now: Instant, forces: StripForces, state: np.ndarray) -> StripForces:
        return forces.plus(*np.split((AT_ONCE - 1) * (_stack(now.water) - state), 3, axis=1))


class Wall(WallProximity):
    """Drag and lift in the share (h / c)^2, levelled off where a plate touches."""

    def water(self, now: Instant, forces: StripForces, state: np.ndarray) -> StripForces:
        strips = now.layout.strips
        origin, normal = np.split(state, 2, axis=1)
        direction = now.pose.direction[:, strips.link]
        place = now.pose.origin_m[:, strips.link] + strips.place_m * direction
        clear = self.distance_m - ((place - origin) * normal.conj()).real
        moving = (now.flow.along_m_s + 1j * now.flow.across_m_s) * direction * normal.conj()
        far = np.hypot(clear, strips.half_height_m)
        share = (strips.half_height_m / far) ** 2
        push = LIFT * moving.imag**2 * clear / far - DRAG * np.abs(moving.real) * moving.real
        pressed = now.parameters.density_kg_m3 * strips.half_height_m * strips.length_m
        force = pressed * share * push * normal * direction.conj()
        return forces.plus(force.real, force.imag)


class Towed(Mechanism):
    """A pull on the head's origin against its velocity."""

    drag_n_s_m: float

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:  # noqa: ARG002
        velocity = now.pose.velocity_m_s[:, :1] - now.parameters.current_m_s
        return now.push(0, 0.0, -self.drag_n_s_m * velocity)


class Layer(Mechanism):
    """Drag on the head by the power 1.5 of its speed along itself."""

    factor: float

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:  # noqa: ARG002
        direction = now.pose.direction[:, :1]
        speed = ((now.pose.velocity_m_s[:, :1] - now.parameters.current_m_s) * direction.conj()).real
        drag = -self.factor * np.sqrt(np.abs(speed)) * speed
        return now.push(0, now.layout.robot.head.fluid_centre_m[0], drag * direction)


class Waves(Mechanism):
    """The hump as a fraction of powers of the Froude number."""

    on_hump: float

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:  # noqa: ARG002
        robot, direction = now.layout.robot, now.pose.direction[:, :1]
        speed = ((now.pose.velocity_m_s[:, :1] - now.parameters.current_m_s) * direction.conj()).real
        froude = np.abs(speed) / np.sqrt(9.81 * 2 * robot.head.fluid_half_size_m[0])
        pressed = 0.5 * now.parameters.density_kg_m3 * robot.elongated_body.reference_area_m2
        drag = -pressed * self.on_hump * wave_drag_ratio(froude) * np.abs(speed) * speed
        return now.push(0, 0.0, drag * direction)


def _segments(ln_head: float, ln_fin: float) -> Mechanism:
    return SegmentCoefficients((ln_head,) * 5, (ln_fin,) * 5)


def _gradient(relative: float) -> Mechanism:
    return StiffnessError(tuple(map(float, np.log(1 + relative * np.linspace(-1.0, 1.0, 5)))))


def _wall(inverse_square: float) -> Mechanism:
    return Wall(float(np.sign(inverse_square)), float(np.abs(inverse_square) ** -0.5))


TWINS_FORMS: Mapping[str, TwinsForm] = {
    "drive_ratio_error": TwinsForm(lambda relative: DriveRatioError(relative, 0.0), (0.02,)),
    "motor_speed_sag": TwinsForm(Sag, (0.03, 0.02)),
    "motor_speed_ripple": TwinsForm(Ripple, (0.05, 0.05)),
    "motor_start_delay": TwinsForm(LateStart, (0.05,)),
    "crank_arm_error": TwinsForm(lambda relative: CrankArmError(relative, relative), (0.018,)),
    "tendon_compliance": TwinsForm(lambda relative: TendonCompliance(relative, relative, 0.0), (2.0,)),
    "tendon_slack": TwinsForm(Slack, (0.002, 0.001)),
    "tendon_friction": TwinsForm(GuideFriction, (0.5,)),
    "tendon_asymmetry": TwinsForm(lambda length_m: TendonAsymmetry(-length_m, length_m), (0.001,)),
    "stiffness_error": TwinsForm(lambda relative: StiffnessError((float(np.log1p(relative)),) * 5), (0.1,)),
    "stiffness_gradient": TwinsForm(_gradient, (0.2,)),
    "stiffness_hardening": TwinsForm(Cubic, (2.0,)),
    "joint_damping": TwinsForm(Damping, (0.3,)),
    "joint_friction": TwinsForm(HingeFriction, (0.03,)),
    "bend_offset": TwinsForm(Bend, (0.03,)),
    "mass_distribution": TwinsForm(TailMass, (0.01, 0.005, 0.005)),
    "entrained_water": TwinsForm(lambda thickness_m: EntrainedWater(thickness_m, 0.0), (0.002,)),
    "added_mass_reaction": TwinsForm(AddedMassReaction, (0.2,)),
    "segment_coefficients": TwinsForm(_segments, (0.3, 0.3)),
    "fluid_memory": TwinsForm(OneWake, (0.01,)),
    "background_current": TwinsForm(lambda right, up: BackgroundCurrent(right, up, 0.0), (0.015, 0.015)),
    "wall_proximity": TwinsForm(_wall, (16.0,)),
    "wave_drag": TwinsForm(Waves, (0.5,)),
    "linear_drag": TwinsForm(Towed, (0.2,)),
    "skin_friction": TwinsForm(lambda times: Layer(0.05 * times), (2.0,)),
    "hull_roll": TwinsForm(
        lambda roll, natural: SurfaceMotion(roll, 0.0, NATURAL_ROLL_HZ * np.exp(natural), PITCH_HZ, DAMPING, 0.05),
        (5.0, 0.1),
    ),
    "surface_motion": TwinsForm(
        lambda roll, pitch: SurfaceMotion(roll, pitch, ROLL_HZ, PITCH_HZ, DAMPING, 0.0), (3.5, 6.0)
    ),
}
