"""The file `truth.json`: what a synthetic session was made with, next to its `session.toml`.

The program never reads it: it is there for whoever judges a result. It holds the plan whole, so that the session can be
made again from it, and what came of the plan in the simulation.
"""

from pathlib import Path

import mujoco
import numpy as np
from scipy.linalg import eigh

from session.results import write_whole
from session.toml_source import Table
from swimmer import RobotSpec, build_mjcf
from swimmer.mjcf import FREE_DECAY
from synthetic.plan import SyntheticPlan
from synthetic.trials import Pixels

TRUTH_FILE = "truth.json"


class DryTruth(Table):
    """The outcome of one planned dry run.

    Attributes:
        frequency_hz: mean turns a second of the simulated crank between the first and the last frame; of the steady
            stretch where a motor is logged.
        phase_rad: crank angle in the first frame, from 0 to 2 pi.
        placement_px: offset between the box and its marker, by marker, x to the right and y down.
        steady_s: from when to when a logged motor turned steadily, on the clock of the video; None without a log.
    """

    frequency_hz: float
    phase_rad: float
    placement_px: dict[str, Pixels]
    steady_s: tuple[float, float] | None = None


class TrialTruth(DryTruth):
    """The outcome of one planned swim.

    Attributes:
        speed_m_s: forward speed of the nose (published normaliser) without noise: slope over the whole beats after the
            warm-up, or of the steady stretch.
    """

    speed_m_s: float


class DecayTruth(Table):
    """The outcome of one planned free decay."""

    placement_px: dict[str, Pixels]


class StructureTruth(Table):
    """The numbers that dry experiments are to find: of each hinge (per rad), of the crank's arm and of the tail.

    `natural_hz` is the lowest natural frequency of the tail in air without tendons: small swings, no damping.
    """

    hinge_stiffness_n_m: float
    hinge_damping_n_m_s: float
    natural_hz: float
    crank_arm_m: float


class Truth(Table):
    """Everything that is known about a synthetic session: its plan, and what came of it, by trial.

    `mujoco` is the version of the engine that made it.
    """

    mujoco: str
    plan: SyntheticPlan
    structure: StructureTruth
    trials: dict[str, TrialTruth]
    dry_runs: dict[str, DryTruth]
    free_decays: dict[str, DecayTruth]


def structure_of(robot: RobotSpec) -> StructureTruth:
    """Compute what dry experiments should find out about a robot."""
    return StructureTruth(
        hinge_stiffness_n_m=robot.tail.hinge_stiffness_n_m,
        hinge_damping_n_m_s=robot.tail.hinge_damping_n_m_s,
        natural_hz=_natural_hz(robot),
        crank_arm_m=robot.crank.arm_m,
    )


def write_truth(folder: Path, truth: Truth) -> None:
    """Write `truth.json` into a session folder."""
    write_whole(folder / TRUTH_FILE, truth.model_dump_json(indent=1) + "\n")


def read_truth(folder: Path) -> Truth:
    """Read the `truth.json` of a synthetic session."""
    return Truth.model_validate_json((folder / TRUTH_FILE).read_bytes())


def _natural_hz(robot: RobotSpec) -> float:
    """Compute the lowest natural frequency of the straight tail from the engine's mass matrix."""
    model = build_mjcf(robot, scene=FREE_DECAY).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    tail = [int(model.joint(name).dofadr[0]) for name in robot.hinges]
    stiffness = robot.tail.hinge_stiffness_n_m * np.eye(len(tail))
    squared = eigh(stiffness, mass[np.ix_(tail, tail)], eigvals_only=True)
    return float(np.sqrt(squared[0]) / (2 * np.pi))
