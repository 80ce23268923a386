"""`truth.json`: what a synthetic session was made with, beside its `session.toml`.

The program never reads it: it is there for whoever judges a result. It holds the plan whole, so that the
session can be made again from it, and what came of the plan in the simulation.
"""

from pathlib import Path

import mujoco
from pydantic import ValidationError

from session import FaultCollector, Table, write_whole
from synthetic.faults import Pixels
from synthetic.plan import SyntheticPlan

TRUTH_FILE = "truth.json"


class TrialTruth(Table):
    """What came of one planned trial.

    Attributes:
        frequency_hz: mean turns a second of the simulated crank between the first and the last frame.
        phase_rad: crank angle in the first frame, from 0 to 2 pi.
        speed_m_s: forward speed of the nose (published normaliser) without noise: slope over the whole beats
            after the warm-up.
        placement_px: offset between the box and its marker, by marker, x to the right and y down.
    """

    frequency_hz: float
    phase_rad: float
    speed_m_s: float
    placement_px: dict[str, Pixels]


class Truth(Table):
    """All that is known about a synthetic session.

    Attributes:
        mujoco: version of the engine that made it.
        plan: what was asked for: coefficients, noise, faults, seed.
        trials: what came of it, by trial.
    """

    mujoco: str
    plan: SyntheticPlan
    trials: dict[str, TrialTruth]


def write_truth(folder: Path, plan: SyntheticPlan, trials: dict[str, TrialTruth]) -> None:
    """Writes `truth.json` into a session folder.

    Raises:
        session.ResultsNotWritable: the folder is not writable.
    """
    truth = Truth(mujoco=mujoco.__version__, plan=plan, trials=trials)
    write_whole(folder / TRUTH_FILE, truth.model_dump_json(indent=1) + "\n")


def read_truth(folder: Path) -> Truth:
    """Reads the `truth.json` of a synthetic session.

    Raises:
        session.InputError: there is none, or it is not one.
    """
    path = folder / TRUTH_FILE
    faults = FaultCollector(str(path))
    try:
        return Truth.model_validate_json(path.read_bytes())
    except FileNotFoundError:
        faults.add("", "no truth here", expected="a session made by `calib new --synthetic`")
    except OSError as error:
        faults.add("", "the truth cannot be read", found=str(error), expected="a readable file")
    except ValidationError as error:
        for fault in error.errors():
            faults.add(".".join(map(str, fault["loc"])), fault["msg"], next_step="Make the session again.")
    faults.raise_if_any()
    raise AssertionError("unreachable")
