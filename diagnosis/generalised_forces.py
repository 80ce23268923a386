"""Forces that are missing, whatever their cause: on the head and in every hinge, as they go with the crank's turn."""

from typing import ClassVar, NamedTuple

import numpy as np

from diagnosis.linear_model import LinearModel
from fitting.model.features import HARMONICS, waves
from fitting.signatures import signature_of
from session.session_file import TrialKind
from swimmer.effects import Effect, Parameter, StepForce, StepState
from swimmer.mjcf import Scene
from swimmer.robot import RobotSpec

HEAD = ("head_along", "head_across", "head_moment")
PER_JOINT = 1 + 2 * HARMONICS
FORCE_N, MOMENT_N_M, TORQUE_N_M = 0.02, 0.004, 0.004  # that responses are measured with


class GeneralisedForces(Effect):
    """Forces along and across the head (N), a moment on it and torques in the hinges (N m), each a mean and harmonics.

    Of the crank's angle. In no catalogue: it stands for whatever is missing.
    """

    name = "generalised_forces"
    family = "fluid"
    stage = "body"
    physics = "Generalised forces that are periodic with the crank."
    source = "Inverse dynamics, linear about the twin."
    seen_in: ClassVar[frozenset[TrialKind]] = frozenset({"swim", "dry"})

    def __init__(self, robot: RobotSpec) -> None:
        self.joints = (*HEAD, *robot.hinges)
        sd = dict.fromkeys(HEAD[:2], FORCE_N) | {HEAD[2]: MOMENT_N_M}
        self.parameters = tuple(
            Parameter(f"{joint}_{number}", "N" if joint in HEAD[:2] else "N m", -1.0, 1.0, sd.get(joint, TORQUE_N_M))
            for joint in self.joints
            for number in range(PER_JOINT)
        )

    @property
    def sd(self) -> np.ndarray:
        """(p,) that responses are measured with."""
        return np.array([parameter.sd for parameter in self.parameters])

    def force(self, robot: RobotSpec, scene: Scene, values: np.ndarray) -> StepForce | None:  # noqa: ARG002
        """On all joints but the crank."""
        if not values.any():
            return None
        amplitudes = values.reshape(len(values), len(self.joints), PER_JOINT)
        free = 0 if scene.head_clamped else len(HEAD)

        def force(state: StepState) -> np.ndarray:
            crank = state.position[:, free]
            columns = np.column_stack([np.ones(len(crank)), waves(crank, HARMONICS)])
            amount = np.einsum("njc,nc->nj", amplitudes, columns)
            result = np.zeros_like(state.velocity)
            if free:
                cos, sin = np.cos(state.position[:, 2]), np.sin(state.position[:, 2])
                result[:, 0] = cos * amount[:, 0] - sin * amount[:, 1]
                result[:, 1] = sin * amount[:, 0] + cos * amount[:, 1]
                result[:, 2] = amount[:, 2]
            result[:, free + 1 :] = amount[:, len(HEAD) :]
            return result

        return force


class ForceResponses(NamedTuple):
    """What missing forces do to the rows of each trial.

    Attributes:
        joints: names of the three of the head and of the hinges.
        columns: (k, t, j, 7) of the row, for one standard force on a joint in one trial alone.
        unit: (j,) that standard force, N or N m.
    """

    joints: tuple[str, ...]
    columns: np.ndarray
    unit: np.ndarray


def responses(linear: LinearModel) -> ForceResponses:
    """To each force alone, linear about the twin."""
    pushes = GeneralisedForces(linear.twin.robot)
    rows = signature_of(pushes, linear.model, linear.camera, linear.at, np.diag(pushes.sd)).rows  # (p, k)
    rows = np.nan_to_num(rows)
    trials, length = len(linear.trials), rows.shape[1]
    own = len(linear.model.measured) // trials
    columns = np.zeros((length, trials, len(rows)))
    for trial in range(trials):
        part = slice(own * trial, own * (trial + 1))
        columns[part, trial] = rows[:, part].T
    unit = pushes.sd.reshape(len(pushes.joints), PER_JOINT)[:, 0]
    return ForceResponses(pushes.joints, columns.reshape(length, trials, len(unit), PER_JOINT), unit)


def across(place_m: float, hinge_m: np.ndarray) -> np.ndarray:
    """(3 + h,) what a force of 1 N to the left at a place of the straight robot is on its joints, N and N m.

    Args:
        place_m: x in the robot's frame.
        hinge_m: (h,) of the hinges.
    """
    return np.concatenate([[0.0, 1.0, place_m], np.maximum(place_m - hinge_m, 0.0)])
