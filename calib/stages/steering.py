"""How the policies of a session swim, for its report: read from `results/policy`, nothing is simulated."""

import json
from pathlib import Path

import numpy as np

from reports.policy_swims import PolicySwims
from session.results import sha256_of

TASKS = ("target", "circle")
SWIMS = ".swims.npz"
"""How the file ends that `calib policy train` writes next to a policy."""


def swims_files(results: Path) -> tuple[Path, ...]:
    """Those that are there, with their cards; targets first."""
    files = [results / "policy" / f"{task}{SWIMS}" for task in TASKS]
    return tuple(file for file in files if file.is_file() and _card(file).is_file())


def read_swims(results: Path) -> tuple[PolicySwims, ...]:
    """Of all policies of a session."""
    fitted = results / "calibrated.xml"
    return tuple(_read(file, sha256_of(fitted) if fitted.is_file() else "") for file in swims_files(results))


def _card(file: Path) -> Path:
    return file.with_name(file.name.removesuffix(SWIMS) + ".json")


def _read(file: Path, fit: str) -> PolicySwims:
    card = json.loads(_card(file).read_text())
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
