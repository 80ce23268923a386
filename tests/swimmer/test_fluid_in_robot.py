"""The forces of the reference, link by link, against what the engine puts on the assembled robot."""

import mujoco
import numpy as np
import pytest

from swimmer import FluidCoefficients, RobotSpec, build_mjcf
from swimmer.fluid import Wrench, fluid_terms
from tests.swimmer.engine_state import random_state
from tests.swimmer.robots import FISH, every_robot

ENGINE_QUADRATURE = 1e-5


def reference_wrench(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> tuple[Wrench, np.ndarray, np.ndarray]:
    """The reference's force and torque on one geom in the world's axes, and its (3, nv) Jacobians."""
    linear, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv))
    place, turn = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)
    mujoco.mj_jac(model, data, linear, angular, place, model.geom_bodyid[geom])
    v, w = turn.T @ linear @ data.qvel, turn.T @ angular @ data.qvel
    coefficients = FluidCoefficients(*model.geom_fluid[geom, 1:6])
    total = fluid_terms(model.geom_size[geom], v, w, coefficients, model.opt.density, model.opt.viscosity).total
    return Wrench(turn @ total.force, turn @ total.torque), linear, angular


def generalised(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """(nv,) sum over the wet geoms of J_v^T f + J_w^T g."""
    force = np.zeros(model.nv)
    for geom in np.flatnonzero(model.geom_fluid[:, 0] > 0):
        wrench, linear, angular = reference_wrench(model, data, int(geom))
        force += linear.T @ wrench.force + angular.T @ wrench.torque
    return force


@pytest.mark.parametrize("seed", range(5))
@every_robot
def test_the_wrenches_of_all_links_add_up_to_the_engines_generalised_force(robot: RobotSpec, seed: int) -> None:
    coefficients = FluidCoefficients(*np.random.default_rng(seed).uniform(0, 10, 5))
    model = build_mjcf(robot, coefficients).compile()
    data = random_state(model, seed)
    expected = generalised(model, data)
    np.testing.assert_allclose(data.qfrc_fluid, expected, rtol=0, atol=ENGINE_QUADRATURE * np.abs(expected).max())


@pytest.mark.parametrize("name", ["head_fluid", "tail_1_plate", "tail_3_plate", "tail_5_plate", "caudal_fin"])
def test_each_link_alone_feels_what_the_reference_says(name: str) -> None:
    model = build_mjcf(FISH).compile()
    for other in np.flatnonzero(model.geom_fluid[:, 0] > 0):
        if model.geom(other).name != name:
            model.geom_fluid[other, 1:] = 0.0  # interaction stays, or the engine would take the body for a box
    viscosity, model.opt.viscosity = model.opt.viscosity, 0.0
    assert viscosity > 0
    data = random_state(model, 3)
    wrench, linear, angular = reference_wrench(model, data, model.geom(name).id)
    expected = linear.T @ wrench.force + angular.T @ wrench.torque
    np.testing.assert_allclose(data.qfrc_fluid, expected, rtol=0, atol=ENGINE_QUADRATURE * np.abs(expected).max())
