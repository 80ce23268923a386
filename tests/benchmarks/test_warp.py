import mujoco
import numpy as np
import pytest

from benchmarks.warp import swim_in_engine, swim_in_warp
from swimcal.mjcf import add_scenery, build_mjcf
from swimcal.robot import load_robot
from tests.swimgym.fish import WATER

RATES_HZ = np.array([0.6, 0.83, 0.9, 1.2])  # with the integrator of the file and a step of 1 ms the last blows up


@pytest.fixture
def model() -> mujoco.MjModel:
    robot = load_robot()
    spec = add_scenery(build_mjcf(robot, WATER), robot)
    rest = spec.compile()
    velocity = np.zeros(rest.nv)
    velocity[rest.joint("surge").dofadr[0]] = -0.2
    velocity[rest.joint("crank").dofadr[0]] = 2 * np.pi
    spec.add_key(name="swim", qpos=rest.qpos0, qvel=velocity)
    spec.compile()
    return mujoco.MjModel.from_xml_string(spec.to_xml())


@pytest.mark.long
def test_an_exported_twin_swims_in_warp_as_in_mujoco_with_the_integrator_of_the_guide(
    model: mujoco.MjModel,
) -> None:
    pytest.importorskip("mujoco_warp", reason="MuJoCo Warp is missing: pip install -e '.[warp]'")
    expected_m = swim_in_engine(model, RATES_HZ)
    model.opt.integrator, model.opt.timestep = mujoco.mjtIntegrator.mjINT_IMPLICITFAST, 0.002
    np.testing.assert_allclose(swim_in_warp(model, RATES_HZ), expected_m, rtol=0.01)


def test_the_measured_way_is_that_of_the_head(model: mujoco.MjModel) -> None:
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    begin = data.body("head").xpos.copy()
    data.ctrl[0] = 2 * np.pi
    mujoco.mj_step(model, data, round(4.0 / model.opt.timestep))
    mujoco.mj_kinematics(model, data)
    way_m = np.linalg.norm((data.body("head").xpos - begin)[:2])
    np.testing.assert_allclose(swim_in_engine(model, np.array([1.0])), way_m, rtol=0.01)
