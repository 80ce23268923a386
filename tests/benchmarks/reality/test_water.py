"""The water against formulas written out here."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.reality import Mechanism
from benchmarks.reality.body import Chain
from benchmarks.reality.fluid import Flow, ReactiveWater, Water
from swimcal.ebt import TailMotion
from tests.benchmarks.reality.motions import COEFFICIENTS, fish, moving, roll, without_tendons
from tests.swimcal.thrust import mean_thrust


class Tow(Mechanism):
    """A steady force on the head, straight ahead."""

    force_n: float

    def force(self, now, state):  # noqa: ARG002
        return now.push(0, 0.0, -self.force_n * now.pose.direction[:, :1])


def test_a_towed_straight_fish_reaches_the_speed_at_which_drag_balances_the_tow():
    layout, parameters = fish()
    robot, (blunt, slender, *_), rho = layout.robot, COEFFICIENTS, 1000.0

    def drag_over_speed_squared(half_height, half_thickness, half_chord, length):
        edge = half_thickness / half_chord
        return rho * np.pi / 2 * half_height * length * (blunt * edge + slender * (1 - edge))

    x, (half_x, half_y, half_z) = robot.head.fluid_centre_m[0], robot.head.fluid_half_size_m
    fin = robot.caudal_fin
    total = drag_over_speed_squared(half_z, half_y, half_x, 2 * half_x)
    total += drag_over_speed_squared(fin.span_m / 2, fin.thickness_m / 2, fin.chord_m / 2, fin.chord_m)
    ends = np.append(robot.hinge_x_m, robot.fin_root_x_m)
    for i, segment in enumerate(robot.tail.segment):
        start = robot.tail.start_m if i == 0 else ends[i]
        half = (ends[i + 1] - ends[i]) / 2
        total += drag_over_speed_squared(segment.half_height_m, segment.thickness_m / 2, half, ends[i + 1] - start)
    tow = 2.0
    velocity = np.zeros(layout.hinges + 3)
    velocity[0] = -0.1
    motion = moving(layout, without_tendons(parameters), [Tow(tow)])
    speeds = roll(motion, np.zeros_like(velocity), velocity, 5.0, 1e-2, lambda _, __, v: -v[0])
    assert speeds[-1] == pytest.approx(np.sqrt(tow / total), rel=1e-6)
    assert x - half_x == pytest.approx(layout.strips.place_m[0] - layout.strips.length_m[0] / 2)


def test_of_a_fish_that_floats_deeper_more_of_every_strip_is_in_the_water():
    layout, parameters = fish()
    still, half_m = np.zeros((1, len(layout.strips.link))), layout.strips.half_height_m
    deeper, flow = replace(parameters, sunk_m=parameters.sunk_m + 0.01), Flow(still - 0.2, still, still)
    drags = [Water(layout, each, Chain(layout, each)).forces(flow).along_n for each in (parameters, deeper)]
    assert (drags[0] > 0).all()
    assert drags[1] / drags[0] == pytest.approx((half_m + 0.005)[None] / half_m)
    pose = Chain(layout, parameters).pose(*np.zeros((2, 1, layout.hinges + 3)))
    theirs = [replace(each, added_mass_reaction=np.ones((1, 1))) for each in (parameters, deeper)]
    masses = [ReactiveWater(layout, each, Chain(layout, each)).inertia(pose)[0, 1, 1] for each in theirs]
    per_mass = [(height**2 * layout.strips.length_m).sum() for height in (half_m, half_m + 0.005)]
    assert masses[1] / masses[0] == pytest.approx(per_mass[1] / per_mass[0])


def test_lift_and_added_mass_do_no_work_and_drag_takes_some():
    layout, parameters = fish()
    random = np.random.default_rng(1)
    position, velocity = random.normal(size=(2, 1, layout.hinges + 3))

    def power(coefficients):
        rows = replace(parameters, coefficients=np.array(coefficients)[None, :, None] * np.ones((1, 1, len(strips))))
        chain = Chain(layout, rows)
        water = Water(layout, rows, chain)
        pose = chain.pose(position, velocity)
        return float(water.on_links(pose, water.forces(water.flow(pose)))[0] @ velocity[0])

    strips = layout.strips.link
    taken = power((1.0, 0.0, 0.0, 0.0, 0.0))
    assert taken < 0
    assert power((0.0, 1.0, 0.0, 0.0, 0.0)) < 0
    assert power((0.0, 0.0, 1.0, 0.0, 0.0)) < 0
    assert abs(power((0.0, 0.0, 0.0, 5.0, 0.0))) < 1e-12 * abs(taken)
    assert abs(power((0.0, 0.0, 0.0, 0.0, 5.0))) < 1e-12 * abs(taken)


def test_a_plate_at_an_angle_is_lifted_as_the_formula_says():
    layout, parameters = fish(coefficients=(0.0, 0.0, 0.0, 4.0, 0.0))
    water, strips = Water(layout, parameters, Chain(layout, parameters)), layout.strips
    ones = np.ones((1, len(strips.link)))
    forces = water.forces(Flow(-0.2 * ones, 0.05 * ones, 0.0 * ones))
    edge = strips.half_thickness_m / strips.half_chord_m
    met = edge + (1 - edge) * 0.05 / np.hypot(0.05, 0.2 * edge)
    strength = 4.0 * 1000.0 * np.pi / 2 * strips.half_height_m * strips.length_m * met / np.hypot(0.2, 0.05)
    assert forces.across_n[0] == pytest.approx(-strength * 0.2**2 * 0.05, rel=1e-6)  # against the sideways motion
    assert forces.along_n[0] == pytest.approx(strength * -0.2 * 0.05**2, rel=1e-6)  # forward, as a sail is drawn


def prescribed_wave(layout, time_s, speed, amplitude):
    """(N,) coordinates, rates and accelerations of a straight head at a steady speed whose tail waves behind it."""
    omega, number = 2 * np.pi * 1.3, 2 * np.pi / 0.3
    x = layout.origin_m[1:]
    size = amplitude * (x - x[0] + 0.02) / (x[-1] - x[0] + 0.02)
    phase = number * x - omega * time_s
    angles = [size * np.sin(phase), -omega * size * np.cos(phase), -(omega**2) * size * np.sin(phase)]
    heads = [(-speed * time_s, 0.0, 0.0), (-speed, 0.0, 0.0), (0.0, 0.0, 0.0)]
    return [np.concatenate(pair)[None] for pair in zip(heads, angles, strict=True)]


@pytest.mark.parametrize("speed", [0.0, 0.1, 0.3])
def test_the_reactive_thrust_of_a_small_wave_is_that_of_elongated_body_theory(speed):
    """Lighthill 1960: T = 1/2 m (<h_t^2> - U^2 <h_x^2>) at the tail tip, m = 1/4 rho pi d^2."""
    layout, parameters = fish(hinges_per_gap=4)
    parameters = replace(parameters, added_mass_reaction=np.ones((1, 1)))
    chain = Chain(layout, parameters)
    water, reactive = Water(layout, parameters, chain), ReactiveWater(layout, parameters, chain)
    fin = layout.robot.caudal_fin
    tip = layout.robot.fin_root_x_m + fin.centre_m + fin.chord_m / 2 - layout.origin_m[-1]
    thrust, lateral, slope = [], [], []
    for time_s in np.arange(64) / 64 / 1.3:
        position, velocity, acceleration = prescribed_wave(layout, time_s, speed, 0.05)
        pose = chain.pose(position, velocity)
        force = reactive.force(pose, water.flow(pose)) - (reactive.inertia(pose) @ acceleration[0])[0]
        thrust.append(-force[0, 0])
        at_tip = pose.velocity_m_s[0, -1] + 1j * tip * pose.rate_rad_s[0, -1] * pose.direction[0, -1]
        lateral.append(at_tip.imag)
        slope.append(np.tan(position[0, -1]))
    motion = TailMotion(np.mean(np.square(lateral)), np.mean(np.square(slope)))
    mass = 0.25 * 1000.0 * np.pi * fin.span_m**2
    expected = mean_thrust(motion, speed, mass)
    assert abs(expected) > 1e-3
    assert np.mean(thrust) == pytest.approx(expected, rel=0.01)


def test_the_water_pushes_back_an_accelerated_straight_fish_with_its_added_mass():
    layout, parameters = fish()
    parameters = replace(parameters, added_mass_reaction=np.ones((1, 1)))
    chain = Chain(layout, parameters)
    size = layout.hinges + 3
    added = ReactiveWater(layout, parameters, chain).inertia(chain.pose(np.zeros((1, size)), np.zeros((1, size))))[0]
    strips = layout.strips
    assert added[1, 1] == pytest.approx((1000 * np.pi * strips.half_height_m**2 * strips.length_m).sum())
    assert abs(added[0]).max() == 0
    assert np.linalg.eigvalsh(added).min() > -1e-12
