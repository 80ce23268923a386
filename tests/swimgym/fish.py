"""A fish that swims well, and a session that it was calibrated in."""

import json
from functools import cache
from pathlib import Path

import numpy as np

from swimcal.mjcf import FluidCoefficients, add_scenery, build_mjcf
from swimcal.results import Provenance, plain_json
from swimcal.robot import load_robot
from swimcal.runs import ENGINE
from swimgym import Fish, load_fish

WATER = FluidCoefficients(0.4, 2.0, 6.0, 4.0, 1.0)


@cache
def fish() -> Fish:
    """The built-in robot in the water of `datasets/sample`."""
    return load_fish().with_coefficients(np.array(WATER))


def session_with_fit(folder: Path, engine: str = ENGINE) -> Path:
    """As much of a calibrated session as swimming takes."""
    (folder / "results").mkdir(parents=True)
    robot = load_robot()
    spec = add_scenery(build_mjcf(robot, WATER), robot)
    spec.compile()
    (folder / "results" / "calibrated.xml").write_text(spec.to_xml())
    stamp = Provenance(engine, "0" * 64, {}, 0, "quick").to_json()
    (folder / "results" / "calibration.json").write_text(json.dumps(plain_json(stamp)))
    return folder
