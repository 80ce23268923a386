"""Which engine and model a calibration was made with. Coefficients fitted with one are void with another."""

import hashlib
from collections.abc import Mapping
from typing import Any

import mujoco

from session import ModelMismatch
from swimmer.fluid import FluidCoefficients
from swimmer.mjcf import SWIM, build_mjcf
from swimmer.robot import RobotSpec

ENGINE = mujoco.__version__


def model_sha256(robot: RobotSpec) -> str:
    """Fingerprint of everything in the robot's swimming model but the fluid coefficients."""
    spec = build_mjcf(robot, FluidCoefficients(0.0, 0.0, 0.0, 0.0, 0.0), SWIM)
    spec.compile()
    return hashlib.sha256(spec.to_xml().encode()).hexdigest()


def check_engine(made_with: Mapping[str, Any], robot: RobotSpec, file: str) -> None:
    """Refuses a calibration made with another engine or another model.

    The fluid model is not the same in every release: with 3.12 the published coefficients swim forward, from 3.14
    on the same file swims backward.

    Args:
        made_with: a result's `mujoco` and `model_sha256`.
        robot: the robot at hand.
        file: the result, for the message.

    Raises:
        ModelMismatch: either differs.
    """
    expected = {"mujoco": ENGINE, "model_sha256": model_sha256(robot)}
    names = {"mujoco": "MuJoCo", "model_sha256": "model"}
    differ = [
        f"{names[key]}: made with {str(made_with.get(key))[:16]}, here {value[:16]}"
        for key, value in expected.items()
        if made_with.get(key) != value
    ]
    if differ:
        raise ModelMismatch(
            f"{file}: this calibration was made with another engine or model ({'; '.join(differ)}). Its coefficients "
            "mean nothing here, because releases of the engine compute different fluid forces. Fit again with "
            "`calib fit`."
        )
