"""Two short swims of the twin itself, noisy, beside twins of robots that are not quite the same."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from diagnosis.discrepancy import discrepancy_for
from diagnosis.linear_model import LinearModel
from fitting.dry_run import with_arm
from fitting.trial import MeasuredTrial
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.robot import RobotSpec
from swimcal.session_file import CameraSpec
from swimcal.twin import Twin
from swimsynth.plan import PLAUSIBLE_COEFFICIENTS
from tests.fitting.exact_swims import ROBOT, exact_dry_run, exact_swims

CAMERA = CameraSpec(fps=60.0, scale_length_m=ROBOT.scale_length_m)
AT = np.array(PLAUSIBLE_COEFFICIENTS, float)  # coefficients of the twin that swims
ARM = 0.03  # by which the arm of the robot that swims is longer than that of the twin


def shorter(by: float = ARM) -> RobotSpec:
    """The robot as it is described to the diagnosis."""
    return with_arm(ROBOT, ROBOT.crank.arm_m / (1 + by))


@lru_cache(maxsize=1)
def trials() -> tuple[MeasuredTrial, ...]:
    return exact_swims(hz=(0.7, 1.1), seconds=4.0, noise_m=3e-4)


@lru_cache(maxsize=1)
def dry_run() -> MeasuredTrial:
    return exact_dry_run(0.9, seconds=4.0, noise_m=3e-4, seed=3)


@lru_cache(maxsize=2)
def linear(robot: str = "same") -> LinearModel:
    twin = Twin(ROBOT if robot == "same" else shorter(), FISHSIM_MARKERS, workers=1)
    discrepancy = discrepancy_for(FISHSIM_MARKERS, ROBOT)
    return LinearModel.of(trials(), twin, CAMERA, discrepancy, AT)
