"""A diagnosis of the sim-to-real gap, as its files tell it."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from session import FaultCollector, read_result_json


@dataclass(frozen=True, eq=False)
class Diagnosed:
    """A diagnosis.

    Attributes:
        data: content of `diagnosis.json`.
        compared: (e,) names of the effects that were compared with each other.
        separation: (e, e) whitened distance from the effect of a row, as strong as these data would have it, to that of
            a column, refitted; the chance to take one for the other is Phi(-d / 2).
    """

    data: Mapping[str, Any]
    compared: tuple[str, ...]
    separation: np.ndarray

    @property
    def verdict(self) -> str:
        """named, inseparable, unexplained or no_gap."""
        return str(self.data["verdict"])

    @property
    def refitted(self) -> tuple[str, ...]:
        """The effects that were added to the twin."""
        return tuple(self.data["effect_parameters"])

    @property
    def held_out(self) -> Mapping[str, Mapping[str, float]]:
        """What each held-out swim says before and after; empty where none was held out."""
        return self.data["gap"].get("trials") or {}

    @property
    def everything(self) -> Mapping[str, Any] | None:
        """The twin with all effects at once; None where that was not asked, or no swim was held out."""
        every: Mapping[str, Any] | None = self.data.get("everything")
        return every if every is not None and every["gap"]["evaluated_on"] else None

    def shares(self, split: str) -> dict[str, float]:
        """Of one split: stage, trial, marker, axis or band."""
        return {name: float(share) for name, share in self.data["where"][f"by_{split}"].items()}


def read_diagnosed(file: Path, arrays_file: Path) -> Diagnosed:
    """Reads `diagnosis.json` and `diagnosis.npz`.

    Raises:
        InputError: there is no diagnosis of this version.
    """
    data, faults = read_result_json(file), FaultCollector(str(arrays_file))
    try:
        with np.load(arrays_file) as arrays:
            return Diagnosed(data, tuple(map(str, arrays["compared"])), arrays["separation"])
    except (OSError, ValueError, KeyError) as error:
        next_step = "Make it again with `calib diagnose`."
        faults.add("", "cannot be read", found=str(error), expected="arrays of a diagnosis", next_step=next_step)
        faults.raise_if_any()
        raise
