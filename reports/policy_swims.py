"""How policies swam, as the report shows it: read from `results/policy`; nothing is simulated."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from session.results import check_whole, sha256_of

TASKS = ("target", "circle")
SWIMS = ".swims.npz"
"""Ending of the file that `calib policy train` writes next to a policy."""


@dataclass(frozen=True, eq=False)
class PolicySwims:
    """The episodes of one policy on the twin.

    Attributes:
        task, method: "target" or "circle"; "search" or "sac".
        of_this_fit: whether it was trained on the twin that the report is about.
        start_m: (n, 2) first targets, from the start, where the robot heads along -x; its left is -y.
        reached, diverged: (n,) how the episodes ended; neither: out of time.
        seconds: (n,) how long they lasted.
        off_path_m: (2, n) mean and largest distance from the path; nan without one.
        path_m: (k, m, 2) paths of the first m episodes, at even times; nan once one is over.
        radius_m: radius of the circle; nan without one.
    """

    task: str
    method: str
    trained_s: float
    seed: int
    of_this_fit: bool
    start_m: np.ndarray
    reached: np.ndarray
    diverged: np.ndarray
    seconds: np.ndarray
    off_path_m: np.ndarray
    path_m: np.ndarray
    radius_m: float = float("nan")

    @property
    def distance_m(self) -> np.ndarray:
        """Distances (n,) of the targets from the start, m."""
        return np.asarray(np.hypot(*self.start_m.T))

    @property
    def aside_rad(self) -> np.ndarray:
        """Angles (n,) of the targets from straight ahead, to either side, rad."""
        return np.asarray(np.abs(np.arctan2(self.start_m[:, 1], -self.start_m[:, 0])))


def swims_files(results: Path) -> tuple[Path, ...]:
    """List the files of swims that are there, with their cards; targets first."""
    files = [results / "policy" / f"{task}{SWIMS}" for task in TASKS]
    return tuple(file for file in files if file.is_file() and _card(file).is_file())


def read_swims(results: Path) -> tuple[PolicySwims, ...]:
    """Read the swims of all policies of a session."""
    fitted = results / "calibrated.xml"
    return tuple(_read(file, sha256_of(fitted) if fitted.is_file() else "") for file in swims_files(results))


def _card(file: Path) -> Path:
    return file.with_name(file.name.removesuffix(SWIMS) + ".json")


def _read(file: Path, fit: str) -> PolicySwims:
    for part in (_card(file), file):
        check_whole(part, "calib policy evaluate")
    card = json.loads(_card(file).read_bytes())
    with np.load(file, allow_pickle=False) as arrays:
        return PolicySwims(
            card["task"],
            card["method"],
            float(card["training"].get("trained_s", np.nan)),
            card["seed"],
            card["model_sha256"] == fit,
            arrays["start_m"],
            arrays["reached"],
            arrays["diverged"],
            arrays["seconds"],
            arrays["off_path_m"],
            arrays["path"],
            radius_m=1.0 if card["task"] == "circle" else np.nan,
        )
