"""Models of the fish with one effect."""

from typing import Any

import mujoco
import numpy as np

from swimcal.effects.affected_twin import AffectedTwin
from swimcal.effects.effect import Effect, Plates, StepState
from swimcal.mjcf import FREE_DECAY, PUBLISHED_COEFFICIENTS, SWIM, Scene
from swimcal.twin import Twin
from tests.swimcal.robots import FISH


def model_with(effect: Effect, values: Any, scene: Scene = FREE_DECAY) -> mujoco.MjModel:
    """The fish with an effect at the given values, compiled."""
    twin = AffectedTwin(Twin(FISH, scene=scene, workers=1), [effect])
    return twin.spec(PUBLISHED_COEFFICIENTS, np.atleast_1d(np.asarray(values, float))).compile()


def plain_model(scene: Scene = FREE_DECAY) -> mujoco.MjModel:
    """The fish without any."""
    return Twin(FISH, scene=scene, workers=1).model


def settled(model: mujoco.MjModel, seconds: float = 1.5, torque: Any = 0.0, **others: Any) -> mujoco.MjData:
    """From rest, straight, with the crank held at 0 and torques on the hinges."""
    data = mujoco.MjData(model)
    data.qfrc_applied[-5:] = torque
    return moved(model, data, seconds, **others)


def moved(model: mujoco.MjModel, data: mujoco.MjData, seconds: float, damper: Any = None) -> mujoco.MjData:
    """On by some seconds, with the damping of an effect changed before each step."""
    joints, tendons = model.dof_damping.copy(), model.tendon_damping.copy()
    for _ in range(round(seconds / model.opt.timestep)):
        if damper is not None:
            added = damper(still(data.qpos[None], data.qvel[None]))
            model.dof_damping[:] = joints + np.squeeze(added.joints)
            model.tendon_damping[:] = tendons + np.squeeze(added.tendons)
        mujoco.mj_step(model, data)
    model.dof_damping[:], model.tendon_damping[:] = joints, tendons
    return data


def still(position: np.ndarray, velocity: np.ndarray) -> StepState:
    """A state of n simulations, (n, q) and (n, v), that neither accelerate nor feel water."""
    return StepState(0.0, position, velocity, np.zeros_like(velocity), np.zeros_like(velocity), Plates(FISH, SWIM))
