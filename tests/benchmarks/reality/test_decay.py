import numpy as np
import pytest
from scipy.linalg import eig

from benchmarks.reality import Nuisances, Trial, World, simulate
from swimcal.robot import load_robot
from tests.benchmarks.reality.motions import COEFFICIENTS
from tests.cases import later


def linearised_chain(robot, at_hinges, stiffness, damping):
    """Slowest swinging eigenvalue (1/s) of M a'' + C a' + K a = 0, in small hinge angles a; parts of uniform mass."""
    tail, fin = robot.tail, robot.caudal_fin
    ends = np.append(robot.hinge_x_m, robot.fin_root_x_m)
    points, masses, across = [], [], []

    def add(kg, start, end, inner=0.0, outer=0.0):
        points.append(start + (np.arange(400) + 0.5) / 400 * (end - start))
        masses.append(np.full(400, kg / 400))
        across.append(np.full(400, (outer**2 + outer * inner + inner**2) / 3))  # mean square of its distance aside

    for i, segment in enumerate(tail.segment):
        kg = tail.density_kg_m3 * segment.length_m * segment.thickness_m * 2 * segment.half_height_m
        add(kg, ends[i], ends[i + 1])
        hinge, half = robot.hinge_x_m[i], segment.gap_m / 2
        add(segment.strip_mass_kg, hinge, hinge + half)
        if i > 0:
            add(segment.strip_mass_kg, hinge - half, hinge)
        guide, length, width = (
            hinge + half + segment.length_m - tail.guide_inset_m,
            tail.guide_plate_length_m,
            segment.guide_plate_width_m,
        )
        kg = 2 * tail.density_kg_m3 * length * width * tail.guide_plate_height_m
        add(kg, guide - length / 2, guide + length / 2, segment.thickness_m / 2, segment.thickness_m / 2 + width)
    add(fin.strip_mass_kg, robot.fin_root_x_m - fin.gap_m, robot.fin_root_x_m)
    middle = robot.fin_root_x_m + fin.centre_m
    add(fin.mass_kg, middle - fin.chord_m / 2, middle + fin.chord_m / 2)
    points, masses, across = (np.concatenate(part) for part in (points, masses, across))
    arms = np.maximum(points - at_hinges[:, None], 0.0)
    behind = (points > at_hinges[:, None]).astype(float)
    mass = (arms * masses) @ arms.T + (behind * masses * across) @ behind.T
    count = len(mass)
    none, one = np.zeros((count, count)), np.eye(count)
    left = np.block([[none, one], [-stiffness * one, -damping * one]])
    right = np.block([[one, none], [none, mass]])
    values = eig(left, right, right=False)
    swinging = values[values.imag > 1.0]
    return swinging[np.argmin(np.abs(swinging))]


@pytest.mark.long
@pytest.mark.parametrize("per_gap", [*later(1), 2])
def test_a_free_decay_swings_as_the_linearised_chain(per_gap):
    robot = load_robot()
    factor = 0.1  # share of the damping, so that it swings for long
    spread = (np.arange(per_gap) + 0.5) / per_gap - 0.5
    gaps = np.array([segment.gap_m for segment in robot.tail.segment])
    hinges = (robot.hinge_x_m[:, None] + 0.4 * gaps[:, None] * spread).ravel()
    value = linearised_chain(
        robot, hinges, per_gap * robot.tail.hinge_stiffness_n_m, factor * per_gap * robot.tail.hinge_damping_n_m_s
    )
    world = World(COEFFICIENTS, Nuisances(hinge_damping=factor))
    small = tuple(0.01 * np.array([1.0, 0.85, 0.65, 0.45, 0.3]))
    (decay,) = simulate([(world, Trial("free_decay", 1.5, bent_rad=small))], hinges_per_gap=per_gap)
    tip = decay.hinges_rad.sum(axis=1)
    crossings = np.flatnonzero(np.diff(np.sign(tip)))
    at = decay.time_s[crossings] - tip[crossings] * np.diff(decay.time_s)[crossings] / np.diff(tip)[crossings]
    at = at[at > 0.2]
    assert np.pi / np.diff(at).mean() == pytest.approx(value.imag, rel=5e-3)
    first, later = (
        np.abs(tip[(decay.time_s >= a) & (decay.time_s < b)]).max() for a, b in [(at[0], at[2]), (at[4], at[6])]
    )
    assert np.log(later / first) == pytest.approx(value.real * (at[4] - at[0]), rel=0.05)


def test_a_held_tail_stays_until_it_is_let_go():
    bent = (0.05, 0.04, 0.03, 0.02, 0.01)
    (decay,) = simulate([(World(COEFFICIENTS), Trial("free_decay", 0.6, bent_rad=bent, release_s=0.25))])
    held = decay.time_s < 0.25
    assert decay.hinges_rad[held] == pytest.approx(np.tile(bent, (held.sum(), 1)), abs=1e-12)
    assert abs(decay.hinges_rad[~held].sum(axis=1)).min() < 0.5 * sum(bent)
    assert (decay.head[:, :2] == 0).all()
