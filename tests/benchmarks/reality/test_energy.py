"""Without drag and dampers nothing is lost: lift, Magnus lift and added mass do no work."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

from benchmarks.reality.body import Chain
from benchmarks.reality.integrate import step
from benchmarks.reality.motion import Motion
from benchmarks.reality.parameters import Parameters
from tests.benchmarks.reality.motions import fish, moving, without_tendons


def free_swing(layout, parameters):
    """(N,) shape in which the free fish swings slowest, and its hinge springs (N, N)."""
    apart = np.diff(np.eye(layout.hinges + 1), axis=0)
    springs = np.zeros((layout.hinges + 3,) * 2)
    springs[2:, 2:] = apart.T @ (parameters.hinge_stiffness_n_m[0][:, None] * apart)
    chain = Chain(layout, parameters)
    mass, _ = chain.inertia(chain.pose(*np.zeros((2, 1, len(springs)))))
    _, modes = eigh(springs, mass[0])
    return modes[:, 3], springs  # after three rigid motions


@pytest.mark.long
def test_energy_is_kept_without_drag_in_water_and_in_air():
    layout, water = fish(coefficients=(0.0, 0.0, 0.0, 4.0, 1.0))
    water = without_tendons(water, hinge_damping_n_m_s=0 * water.hinge_damping_n_m_s)
    both = Parameters.stacked([water, replace(water, density_kg_m3=np.zeros((1, 1)))])
    shape, springs = free_swing(layout, both)
    position = np.tile(shape * 0.3 / (shape[-1] - shape[2]), (2, 1))
    velocity = np.zeros_like(position)
    velocity[:, :3], velocity[:, 3:] = (-0.15, 0.02, 0.3), 0.3  # swims, drifts, turns
    motion = Motion(layout, both, np.zeros(2), np.zeros(2), [(), ()])

    def energy():
        mass, _ = motion.chain.inertia(motion.chain.pose(position, velocity))
        return 0.5 * (
            np.einsum("ni,nij,nj->n", velocity, mass, velocity) + ((position @ springs) * position).sum(axis=1)
        )

    first, bends, step_s = energy(), [], 5e-4
    for k in range(1000):
        position, velocity, _ = step(motion, np.full((2, 1), k * step_s), position, velocity, [], step_s)
        bends.append(position[:, -1] - position[:, 2])
    assert (np.ptp(bends, axis=0) > 0.2).all()  # they do swing
    assert energy() == pytest.approx(first, rel=1e-4)


def test_the_mass_matrix_is_that_of_the_kinetic_energy_of_its_points():
    layout, parameters = fish()
    random = np.random.default_rng(3)
    size = layout.hinges + 3
    position, velocity = random.normal(size=(2, 1, size))
    bars = np.linspace(-1, 1, 3)[:, None] * np.sqrt(1.5)  # three points with a bar's mass and inertia
    mass, middle = parameters.link_mass_kg, parameters.link_moment_kg_m / parameters.link_mass_kg
    radius = np.sqrt(parameters.link_inertia_kg_m2 / mass - middle**2)
    pose = Chain(layout, parameters).pose(position, velocity)
    points = pose.velocity_m_s + 1j * pose.rate_rad_s * pose.direction * (middle + bars * radius)
    expected = 0.5 * (mass / 3 * np.abs(points) ** 2).sum()
    matrix, _ = Chain(layout, parameters).inertia(pose)
    assert 0.5 * velocity[0] @ matrix[0] @ velocity[0] == pytest.approx(expected, rel=1e-12)


def test_inertial_forces_are_the_derivative_of_the_momentum_less_that_of_the_energy():
    """Lagrange's equations by finite differences: M' v - dT/dq is minus the inertial force."""
    layout, parameters = fish()
    chain = Chain(layout, parameters)
    position, velocity = np.random.default_rng(4).normal(size=(2, layout.hinges + 3))

    def mass(q):
        return chain.inertia(chain.pose(q[None], velocity[None]))[0][0]

    _, force = chain.inertia(chain.pose(position[None], velocity[None]))
    nudge = 1e-6
    along = (mass(position + nudge * velocity) - mass(position - nudge * velocity)) @ velocity / (2 * nudge)
    ahead = [mass(position + nudge * e) - mass(position - nudge * e) for e in np.eye(len(position))]
    slope = np.array([0.5 * velocity @ each @ velocity / (2 * nudge) for each in ahead])
    assert force[0] == pytest.approx(slope - along, abs=1e-6 * np.abs(along).max())


def test_tendons_pull_along_the_slope_of_their_length():
    layout, parameters = fish()
    parameters = replace(parameters, tendon_damping_n_s_m=0 * parameters.tendon_damping_n_s_m)
    motion = moving(layout, parameters)
    position = np.concatenate([[0.1, -0.2, 0.4], 0.4 + np.cumsum(np.linspace(0.08, -0.05, layout.hinges))])
    still = np.zeros_like(position)

    def stretch(q):
        equations = motion.equations(np.full((1, 1), 0.0), q[None], still[None], [], 1e-3)
        return equations.now.pull.stretch_m[0]

    nudge = 1e-6
    slopes = np.array([(stretch(position + nudge * e) - stretch(position - nudge * e)) for e in np.eye(len(position))])
    now = motion.equations(np.zeros((1, 1)), position[None], still[None], [], 1e-3).now
    assert now.pull.gradient_m[0] == pytest.approx(slopes.T / (2 * nudge), abs=1e-8)
