"""A keyframe that is turned swims as before, into another direction of the pool."""

import mujoco
import numpy as np
import pytest

from calib.stages.fit import nominal_mjcf, turn_start
from swimcal.robot import load_robot


def swum(model: mujoco.MjModel, qpos: np.ndarray, qvel: np.ndarray) -> np.ndarray:
    """Where the head is after half a second."""
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.qpos[:], data.qvel[:] = qpos, qvel
    mujoco.mj_step(model, data, nstep=round(0.5 / model.opt.timestep))
    return np.array([data.joint(name).qpos[0] for name in ("surge", "sway", "yaw")])


@pytest.mark.parametrize("by_rad", [0.4, -2.0, np.pi])
def test_a_turn_start_swims_the_same_way_turned(by_rad: float) -> None:
    model = mujoco.MjModel.from_xml_string(nominal_mjcf(load_robot()))
    qpos, qvel = model.key_qpos[0].copy(), model.key_qvel[0].copy()
    qvel[[model.joint(name).dofadr[0] for name in ("surge", "sway", "yaw")]] = -0.1, 0.03, 0.2
    x, y, yaw = swum(model, qpos, qvel)
    turned = np.array([[np.cos(by_rad), -np.sin(by_rad)], [np.sin(by_rad), np.cos(by_rad)]]) @ [x, y]
    after = swum(model, *turn_start(model, qpos, qvel, by_rad))
    np.testing.assert_allclose(after, [*turned, yaw + by_rad], atol=1e-6)
    assert np.hypot(x, y) > 0.02
