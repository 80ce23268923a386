"""The calibrated MJCF: the fitted twin as a file that plain MuJoCo runs, with a start for every fit trial."""

import mujoco
import numpy as np

from fitting import Calibration
from session import program_version
from swimmer import ENGINE, Runs, Twin, build_mjcf, model_sha256


def calibrated_mjcf(calibration: Calibration) -> str:
    """The text of `results/calibrated.xml`.

    One keyframe a fit trial, named like it, starts the twin as that trial started: swimming, with the crank turning
    at the measured frequency (its control is part of the keyframe).
    """
    spec = build_mjcf(calibration.robot, calibration.coefficients)
    made_with = f"{program_version()}, MuJoCo {ENGINE}, model {model_sha256(calibration.robot)}"
    spec.add_text(name="calibrated_with", data=made_with)
    twin = Twin(calibration.robot, markers=("nose", "neck"))
    for trial in calibration.trials:
        if trial.measured.role != "fit":
            continue
        hz = trial.simulated_hz
        runs = Runs(
            coefficients=np.array([calibration.coefficients], float),
            frequency_hz=np.array([hz]),
            phase_rad=np.array([trial.phase_rad]),
            velocity=trial.measured.start_velocity[None],
        )
        position, velocity = twin.start(runs)
        spec.add_key(name=trial.measured.name, qpos=position[0], qvel=velocity[0], ctrl=[2 * np.pi * hz])
    spec.compile()
    text: str = spec.to_xml()
    mujoco.MjModel.from_xml_string(text)  # what is written must load
    return text
