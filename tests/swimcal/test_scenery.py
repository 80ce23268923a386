from __future__ import annotations

import mujoco
import numpy as np
import pytest

from swimcal.mjcf import add_scenery, build_mjcf
from swimcal.robot import load_robot


@pytest.fixture(scope="module")
def models() -> tuple[mujoco.MjModel, mujoco.MjModel]:
    """Bare, and with scenery, each as its file says."""
    robot = load_robot()
    specs = build_mjcf(robot), add_scenery(build_mjcf(robot), robot)
    for spec in specs:
        spec.compile()
    bare, dressed = (mujoco.MjModel.from_xml_string(spec.to_xml()) for spec in specs)
    return bare, dressed


def test_the_trajectory_is_the_same_to_the_last_digit(models: tuple[mujoco.MjModel, mujoco.MjModel]) -> None:
    states = []
    for model in models:
        data = mujoco.MjData(model)
        data.ctrl[0] = data.joint("crank").qvel[0] = 2 * np.pi * 1.3
        for _ in range(800):
            mujoco.mj_step(model, data)
        states.append((data.qpos.copy(), data.qvel.copy()))
    np.testing.assert_array_equal(states[0], states[1])
    assert abs(states[0][0][0]) > 0.1  # it swam


def test_sensors_say_where_head_crank_and_hinges_are(models: tuple[mujoco.MjModel, mujoco.MjModel]) -> None:
    model, data = models[1], mujoco.MjData(models[1])
    data.qpos[:] = np.linspace(0.1, 0.8, model.nq)
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.sensor("head_position").data, data.body("head").xpos)
    assert data.sensor("tail_3_angle").data[0] == data.joint("tail_3").qpos[0]
    assert data.sensor("crank_angle").data[0] == data.joint("crank").qpos[0]


def test_it_has_light_cameras_a_floor_and_a_limited_control(models: tuple[mujoco.MjModel, mujoco.MjModel]) -> None:
    model = models[1]
    assert {model.camera(number).name for number in range(model.ncam)} == {"follow", "above"}
    assert model.nlight == 1
    assert model.geom("floor").contype == 0
    assert model.actuator("motor").ctrlrange[1] == pytest.approx(2 * np.pi * 15)
