"""The engine's own log, kept quiet, and the check of which engine and model a calibration was made with.

Where we look for divergence we report it in our own words. Coefficients fitted with one engine are void with another.
"""

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager

import mujoco

from session.errors import ModelMismatch
from session.results import Provenance
from swimmer.fluid import FluidCoefficients
from swimmer.mjcf import SWIM, build_mjcf
from swimmer.robot import RobotSpec

ENGINE = mujoco.__version__


@contextmanager
def quiet_engine() -> Iterator[None]:
    """Keep the engine from printing warnings and from writing MUJOCO_LOG.TXT into the user's folder."""
    before, quiet = mujoco.MjLogConfig.get(), mujoco.MjLogConfig.get()
    quiet.logto_console = quiet.logto_file = False
    quiet.set()
    try:
        yield
    finally:
        before.set()


def model_sha256(robot: RobotSpec) -> str:
    """Return a hash of everything in the robot's swimming model but the fluid coefficients."""
    spec = build_mjcf(robot, FluidCoefficients(0.0, 0.0, 0.0, 0.0, 0.0), SWIM)
    spec.compile()
    return hashlib.sha256(spec.to_xml().encode()).hexdigest()


def check_engine(made_with: Provenance, robot: RobotSpec, file: str) -> None:
    """Refuse a calibration made with another engine or another model.

    The fluid model is not the same in every release: with 3.12 the published coefficients swim forward, from 3.14 on
    the same file swims backward.

    Args:
        made_with: engine and model of the calibration.
        robot: the robot.
        file: name of the calibration in messages.

    Raises:
        ModelMismatch: either differs.
    """
    pairs = {"MuJoCo": (made_with.mujoco, ENGINE), "model": (made_with.model_sha256, model_sha256(robot))}
    differ = [f"{what}: made with {then[:16]}, here {now[:16]}" for what, (then, now) in pairs.items() if then != now]
    if differ:
        raise ModelMismatch(
            f"{file}: this calibration was made with another engine or model ({'; '.join(differ)}). Its coefficients "
            "mean nothing here, because releases of the engine compute different fluid forces. Fit again with "
            "`calib fit`."
        )
