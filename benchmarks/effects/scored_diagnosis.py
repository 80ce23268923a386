"""Diagnosis of a session by any program: what the scores need of its `diagnosis.json`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, FiniteFloat, TypeAdapter, ValidationError

from swimcal.errors import Fault, FaultCollector, InputError

NONE = "none_of_these"
_CAUSES = ("camera", "drive", "body", "tail")  # An effect acts at one of these stages.
_SHOWN_CHARACTERS = 120  # A fault is shown up to this length.


@dataclass(frozen=True)
class Gap:
    """Gap of held-out swims, by a twin that was fitted to others; None is what does not apply."""

    # shrinkage, shrinkage_ci95: share by which the gap is smaller than the plain twin's, and its 95 % interval
    shrinkage: FiniteFloat | None = None
    shrinkage_ci95: tuple[FiniteFloat | None, FiniteFloat | None] | None = None


@dataclass(frozen=True)
class Where:
    """Shares of the gap by stage."""

    by_stage: dict[str, FiniteFloat | None] | None = None


@dataclass(frozen=True)
class Diagnosis:
    """Diagnosis by the public contract; what else the contract has stays unread."""

    verdict: Literal["named", "inseparable", "unexplained", "no_gap"]
    # groups that act together (outer) of alternatives (inner)
    groups: tuple[Annotated[tuple[str, ...], Field(min_length=1, max_length=3)], ...]
    probabilities: dict[str, Annotated[float, Field(ge=0, le=1)]]  # probability that an effect is present, by name
    where: Where | None = None  # shares of the gap
    gap: Gap | None = None  # gap with the effects that are named
    seconds: FiniteFloat | None = None  # duration of the diagnosis; None where it is not given
    withheld_from_catalogue: tuple[str, ...] | None = None  # effects that the catalogue lacked

    @property
    def named_groups(self) -> tuple[tuple[str, ...], ...]:
        """Groups of a verdict that names some."""
        return self.groups if self.verdict in ("named", "inseparable") else ()

    @property
    def names(self) -> frozenset[str]:
        """All names in the groups."""
        return frozenset(name for group in self.named_groups for name in group)

    @property
    def first(self) -> str | None:
        """Most probable of the names."""
        return max(sorted(self.names), key=lambda name: self.probabilities.get(name, 0.0), default=None)

    @property
    def probability_of(self) -> dict[str, float]:
        """Probabilities of effects."""
        return {name: p for name, p in self.probabilities.items() if name != NONE}

    @property
    def stage(self) -> str | None:
        """Stage that most of the gap is put on."""
        by_stage = (self.where or Where()).by_stage or {}
        shares = {stage: share for stage in _CAUSES if (share := by_stage.get(stage)) is not None}
        return max(shares, key=lambda stage: shares[stage]) if shares else None

    @property
    def shrinkage(self) -> float | None:
        """Shrinkage of the gap on held-out trials."""
        return (self.gap or Gap()).shrinkage

    @property
    def interval(self) -> tuple[float, float] | None:
        """95 % interval of the shrinkage."""
        low, high = (self.gap or Gap()).shrinkage_ci95 or (None, None)
        return None if low is None or high is None else (low, high)


_CONTRACT = TypeAdapter(Diagnosis)


def read_diagnosis(path: Path, lacking: frozenset[str] = frozenset()) -> Diagnosis:
    """Read a diagnosis.

    Args:
        path: the file.
        lacking: effects that the catalogue must have lacked with which it was made, and no others.

    Raises:
        InputError: it is not there, not by the contract, or made with another catalogue; all faults at once.
    """
    faults = FaultCollector(str(path))
    again = "Diagnose it again."
    try:
        found = _CONTRACT.validate_json(path.read_text(encoding="utf-8"), strict=True)
    except OSError as error:
        unread = Fault(str(path), "", "cannot be read", str(error), "a diagnosis.json", next_step=again)
        raise InputError([unread]) from error
    except ValidationError as error:
        for fault in error.errors():
            key, expected = ".".join(map(str, fault["loc"])), fault["msg"].removeprefix("Input should be ")
            found_there = "nothing" if fault["type"] == "missing" else repr(fault["input"])[:_SHOWN_CHARACTERS]
            faults.add(key, "not by the contract", found=found_there, expected=expected, next_step=again)
        faults.raise_if_any()
        raise
    withheld = set(found.withheld_from_catalogue or ())
    if withheld != lacking:
        there, asked = (", ".join(sorted(names)) or "nothing withheld" for names in (withheld, lacking))
        faults.add(
            "withheld_from_catalogue", "made with another catalogue", found=there, expected=asked, next_step=again
        )
    faults.raise_if_any()
    return found
