"""What a program says of a session: its `diagnosis.json`, whoever wrote it, as far as scores need it."""

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from session import FaultCollector

NONE = "none_of_these"
VERDICTS = ("named", "inseparable", "unexplained", "no_gap")
_PAIR, _KINDS = 2, ("swim", "dry")
_CAUSES = ("camera", "drive", "body", "tail")  # stages that an effect can act at


class Recommended(NamedTuple):
    """A trial that a diagnosis wants to see, by `trial` of its `next_experiments`.

    Attributes:
        separates: two names.
        kind: "swim" or "dry".
        commanded_hz: that the motor is told.
        logged: whether the motor is to be logged.
    """

    separates: frozenset[str]
    kind: str
    commanded_hz: float
    logged: bool


@dataclass(frozen=True)
class Told:
    """A diagnosis by the public contract.

    Attributes:
        verdict: one of four.
        groups: alternatives (inner) that act together (outer).
        probabilities: that an effect is present, by name.
        by_stage: shares of the gap.
        shrinkage: of the gap on held-out trials; None where it does not apply.
        interval: its 95 % interval.
        seconds: that it took; None where it is not told.
        recommended: trials that would separate what is confused, the most telling first.
    """

    verdict: str
    groups: tuple[tuple[str, ...], ...]
    probabilities: dict[str, float]
    by_stage: dict[str, float]
    shrinkage: float | None
    interval: tuple[float, float] | None
    seconds: float | None
    recommended: tuple[Recommended, ...] = ()

    @property
    def names(self) -> frozenset[str]:
        """All that it names."""
        return frozenset(name for group in self.groups for name in group)

    @property
    def first(self) -> str | None:
        """The likeliest of what it names."""
        return max(sorted(self.names), key=lambda name: self.probabilities.get(name, 0.0), default=None)

    @property
    def chances(self) -> dict[str, float]:
        """Probabilities of effects."""
        return {name: p for name, p in self.probabilities.items() if name != NONE}

    @property
    def stage(self) -> str | None:
        """The stage that it puts most of the gap on."""
        shares = {stage: self.by_stage[stage] for stage in _CAUSES if stage in self.by_stage}
        return max(shares, key=lambda stage: shares[stage]) if shares else None

    def to_json(self) -> dict[str, Any]:
        """By the contract, as far as it is known."""
        return {
            "verdict": self.verdict,
            "groups": self.groups,
            "effects": sorted(self.names),
            "probabilities": self.probabilities,
            "where": {"by_stage": self.by_stage} if self.by_stage else None,
            "gap": {"shrinkage": self.shrinkage, "shrinkage_ci95": self.interval},
            "seconds": self.seconds,
        }


def read_told(path: Path, lacking: frozenset[str] = frozenset()) -> Told:
    """Reads a diagnosis.

    Args:
        path: of the file.
        lacking: effects that the catalogue which it was made with must have lacked, and no others.

    Raises:
        InputError: it is not there, not by the contract, or made with another catalogue; all faults at once.
    """
    faults = FaultCollector(str(path))
    try:
        stands = json.loads(path.read_text())
    except (OSError, ValueError) as error:
        faults.add("", "cannot be read", found=str(error), expected="a diagnosis.json", next_step="Diagnose it again.")
        faults.raise_if_any()
        raise
    return told_of(stands, str(path), lacking)


def told_of(stands: Any, where: str, lacking: frozenset[str] = frozenset()) -> Told:
    """From JSON.

    Args:
        stands: what was read.
        where: it was read from.
        lacking: see `read_told`.

    Raises:
        InputError: it is not by the contract, or made with another catalogue; all faults at once.
    """
    faults = FaultCollector(where)
    _check(stands, lacking, faults)
    faults.raise_if_any()
    gap = stands["gap"] or {}
    interval = gap.get("shrinkage_ci95")
    return Told(
        verdict=stands["verdict"],
        groups=tuple(tuple(group) for group in stands["groups"]) if _names_any(stands) else (),
        probabilities=stands["probabilities"],
        by_stage=(stands["where"] or {}).get("by_stage") or {},
        shrinkage=gap.get("shrinkage"),
        interval=None if interval is None or None in interval else (interval[0], interval[1]),
        seconds=stands.get("seconds"),
        recommended=tuple(_recommended(stands)),
    )


def _recommended(stands: dict[str, Any]) -> Iterator[Recommended]:
    """Of what it recommends, all that is a trial."""
    for each in stands.get("next_experiments") or ():
        if (trial := each.get("trial")) is not None:
            logged = bool(trial.get("logged", False))
            yield Recommended(frozenset(each["separates"]), trial["kind"], float(trial["commanded_hz"]), logged)


def _names_any(stands: dict[str, Any]) -> bool:
    return stands["verdict"] in ("named", "inseparable")


def _is_recommended(each: Any) -> bool:
    """Whether an experiment names two effects and, as its trial, nothing or a swim or a dry run at a speed."""
    if not isinstance(each, dict) or len(each.get("separates") or ()) != _PAIR:
        return False
    trial = each.get("trial")
    if trial is None:
        return True
    hz = trial.get("commanded_hz") if isinstance(trial, dict) else None
    return isinstance(hz, int | float) and 0 < hz < math.inf and trial.get("kind") in _KINDS


def _check(stands: Any, lacking: frozenset[str], faults: FaultCollector) -> None:
    present = stands if isinstance(stands, dict) else {}
    missing = [key for key in ("verdict", "groups", "probabilities", "where", "gap") if key not in present]
    for key in missing:
        faults.add(key, "missing", found="nothing", expected="a key of the contract", next_step="Diagnose it again.")
    if missing:
        return
    if (found := set(stands.get("withheld_from_catalogue") or ())) != lacking:
        faults.add(
            "withheld_from_catalogue",
            "made with another catalogue",
            found=", ".join(sorted(found)) or "nothing withheld",
            expected=", ".join(sorted(lacking)) or "nothing withheld",
            next_step="Diagnose it again.",
        )
    if stands["verdict"] not in VERDICTS:
        faults.add(
            "verdict",
            "not a verdict",
            found=repr(stands["verdict"]),
            expected=" or ".join(VERDICTS),
            next_step="Diagnose it again.",
        )
    for number, each in enumerate(stands.get("next_experiments") or ()):
        if not _is_recommended(each):
            faults.add(
                f"next_experiments[{number}]",
                "not an experiment",
                found=repr(each)[:120],
                expected='"separates": two names; "trial": null, or "kind" swim or dry and "commanded_hz" above 0',
                next_step="Diagnose it again.",
            )
    for name, p in stands["probabilities"].items():
        if not 0 <= p <= 1:
            faults.add(
                f"probabilities.{name}",
                "not a probability",
                found=repr(p),
                expected="from 0 to 1",
                next_step="Diagnose it again.",
            )
