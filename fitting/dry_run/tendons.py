"""What the tendons do while the tail is driven in air: how far they stretch, and for how long they are slack."""

from dataclasses import replace
from typing import NamedTuple

import mujoco
import numpy as np

from fitting.dry_run.response import TIMESTEP_S
from swimmer import RobotSpec, Runs, Twin
from swimmer.mjcf import DRY

PUBLISHED_STRETCH = 0.03  # "Simple Models, Real Swimming" (2026): about 3 % in use
SLACK = 1e-3  # a tendon shorter than at rest by more than this share is slack
_ANGLES = 60  # of a turn, at which the tendons are looked at


class TendonUse(NamedTuple):
    """Both tendons over one settled turn.

    Attributes:
        stretch: longest length over that at rest, less 1.
        shortening: 1 less the shortest length over that at rest.
        slack_share: of turn and tendons in which a string would be slack; the twin's springs push there.
    """

    stretch: float
    shortening: float
    slack_share: float


def tendon_use(robot: RobotSpec, hz: np.ndarray, workers: int = 0) -> tuple[TendonUse, ...]:
    """The tendons of a robot in air at each of s speeds, turns a second.

    Raises:
        SimulationDiverged: the motion does not stay bounded.
    """
    twin = Twin(robot, ("nose",), replace(DRY, timestep_s=TIMESTEP_S), workers)
    time_s = (1.0 + np.arange(_ANGLES) / _ANGLES) / hz[:, None]
    run = twin.simulate(Runs(np.zeros((len(hz), 5)), hz, np.zeros(len(hz))), time_s)
    states = np.concatenate(
        [run.crank_rad[..., None], run.hinges_rad], axis=-1
    )  # (s, angles, q): a clamped head has none
    longer = [_elongation(twin.model, turn) for turn in states]
    return tuple(TendonUse(float(e.max()), float(-e.min()), float((e < -SLACK).mean())) for e in longer)


def _elongation(model: mujoco.MjModel, states: np.ndarray) -> np.ndarray:
    """(k, tendons) length over that at rest, less 1, in k states (k, q)."""
    data = mujoco.MjData(model)
    length = np.zeros((len(states), model.ntendon))
    for i, state in enumerate(states):
        data.qpos[:] = state
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_tendon(model, data)
        length[i] = data.ten_length
    return length / model.tendon_lengthspring[:, 0] - 1
