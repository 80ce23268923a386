"""States of a model, and what the engine says of them."""

from collections.abc import Mapping

import mujoco
import numpy as np

from swimcal.robot import RobotSpec


def random_state(model: mujoco.MjModel, seed: int) -> mujoco.MjData:
    """A bent robot somewhere in the pool, in motion, with everything that depends on it computed."""
    rng = np.random.default_rng(seed)
    data = mujoco.MjData(model)
    data.qpos[:] = rng.uniform(-0.8, 0.8, model.nq)
    data.qvel[:] = rng.normal(0, 1, model.nv)
    mujoco.mj_forward(model, data)
    return data


def at_pose(model: mujoco.MjModel, pose: Mapping[str, float]) -> mujoco.MjData:
    """The robot at rest with the given joint positions (m, rad) and the others 0."""
    data = mujoco.MjData(model)
    for joint, position in pose.items():
        data.joint(joint).qpos[0] = position
    mujoco.mj_forward(model, data)
    return data


def stretch(model: mujoco.MjModel, robot: RobotSpec, crank_rad: float, hinges_rad: np.ndarray) -> np.ndarray:
    """(2,) relative lengthening of either tendon against the straight tail."""
    rest = at_pose(model, {}).ten_length.copy()
    pose = {"crank": crank_rad, **dict(zip(robot.hinges, hinges_rad, strict=True))}
    return at_pose(model, pose).ten_length / rest - 1
