"""A diagnosis of the sim-to-real gap as the report shows it."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from diagnosis.result import DIAGNOSIS, AllEffects, DiagnosisResult, HeldOutSwim
from session.results import read_provenance


@dataclass(frozen=True, eq=False)
class Diagnosed:
    """A diagnosis.

    Attributes:
        data: what `diagnosis.json` holds.
        effort: that it was made with.
    """

    data: DiagnosisResult
    effort: str = "full"

    @property
    def verdict(self) -> str:
        """named, inseparable, unexplained or no_gap."""
        return self.data.verdict

    @property
    def refitted(self) -> tuple[str, ...]:
        """The effects that were added to the twin."""
        return tuple(self.data.effect_parameters)

    @property
    def held_out(self) -> Mapping[str, HeldOutSwim]:
        """What each held-out swim says before and after; empty where none was held out."""
        return self.data.gap.trials or {}

    @property
    def everything(self) -> AllEffects | None:
        """The twin with all effects at once; None where that was not asked, or no swim was held out."""
        every = self.data.everything
        return every if every is not None and every.gap.evaluated_on else None

    @property
    def compared(self) -> tuple[str, ...]:
        """(e,) names of the effects that were compared with each other."""
        return self.data.evidence.separation.compared

    @property
    def separation(self) -> np.ndarray:
        """(e, e) whitened distances between them, see `diagnosis.result.Separation`."""
        return self.data.evidence.separation.distance

    def shares(self, split: str) -> dict[str, float]:
        """Of one split: stage, trial, marker, axis or band."""
        return dict(asdict(self.data.where)[f"by_{split}"])


def read_diagnosed(results: Path) -> Diagnosed:
    """Reads `diagnosis.json` in a folder of results.

    Raises:
        InputError: there is no diagnosis of this version.
    """
    return Diagnosed(DIAGNOSIS.read(results), read_provenance(results / DIAGNOSIS.name).effort)
