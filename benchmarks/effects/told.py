"""What a program says of a session: its `diagnosis.json`, whoever wrote it, as far as scores need it."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError, model_validator

from session import FaultCollector

NONE = "none_of_these"
_CAUSES = ("camera", "drive", "body", "tail")  # stages that an effect can act at
_SHOWN = 120  # characters of what is wrong


class Recommended(NamedTuple):
    """A trial that a diagnosis wants to see, by `trial` of its `next_experiments`.

    Attributes:
        separates: two names.
        kind: of the trial.
        commanded_hz: that the motor is told; None of a free decay.
        logged: whether the motor is to be logged.
    """

    separates: tuple[str, str]
    kind: Literal["swim", "dry", "free_decay"]
    commanded_hz: float | None
    logged: bool


class Forecast(NamedTuple):
    """Of held-out swims, by a twin that was fitted to others.

    Attributes:
        shrinkage: of the gap; None where it does not apply.
        speed_before, speed_after: mean error of the speeds of the plain twin and of this one, m/s; None where no swim
            counts.
    """

    shrinkage: float | None = None
    speed_before: float | None = None
    speed_after: float | None = None


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
        named: what the twin with the named effects forecasts; None where nothing is.
        together: what the one with all effects at once does; None where that is not called for, or was not asked.
        effort: with which it was made; None where that is not told.
    """

    verdict: str
    groups: tuple[tuple[str, ...], ...] = ()
    probabilities: dict[str, float] = field(default_factory=dict)
    by_stage: dict[str, float] = field(default_factory=dict)
    shrinkage: float | None = None
    interval: tuple[float, float] | None = None
    seconds: float | None = None
    recommended: tuple[Recommended, ...] = ()
    named: Forecast | None = None
    together: Forecast | None = None
    effort: str | None = None

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


def read_told(path: Path, lacking: frozenset[str] = frozenset()) -> Told:
    """Reads a diagnosis.

    Args:
        path: of the file.
        lacking: effects that the catalogue which it was made with must have lacked, and no others.

    Raises:
        InputError: it is not there, not by the contract, or made with another catalogue; all faults at once.
    """
    faults = FaultCollector(str(path))
    again = "Diagnose it again."
    try:
        found = _Contract.model_validate_json(path.read_text())
    except OSError as error:
        faults.add("", "cannot be read", found=str(error), expected="a diagnosis.json", next_step=again)
        faults.raise_if_any()
        raise
    except ValidationError as error:
        for fault in error.errors():
            key, said = ".".join(map(str, fault["loc"])), fault["msg"].removeprefix("Input should be ")
            found_there = "nothing" if fault["type"] == "missing" else repr(fault["input"])[:_SHOWN]
            faults.add(key, "not by the contract", found=found_there, expected=said, next_step=again)
        faults.raise_if_any()
        raise
    withheld = set(found.withheld_from_catalogue or ())
    if withheld != lacking:
        there, asked = (", ".join(sorted(names)) or "nothing withheld" for names in (withheld, lacking))
        faults.add(
            "withheld_from_catalogue", "made with another catalogue", found=there, expected=asked, next_step=again
        )
    faults.raise_if_any()
    return found.told()


class _Part(BaseModel):
    """Of a diagnosis by the contract, as far as scores need it; what else there is stays unread."""

    model_config = ConfigDict(strict=True)


class _Where(_Part):
    by_stage: dict[str, FiniteFloat | None] | None = None


class _Gap(_Part):
    shrinkage: FiniteFloat | None = None
    shrinkage_ci95: tuple[FiniteFloat | None, FiniteFloat | None] | None = None
    speed_mae_before: FiniteFloat | None = None
    speed_mae_after: FiniteFloat | None = None

    @property
    def forecast(self) -> Forecast:
        return Forecast(self.shrinkage, self.speed_mae_before, self.speed_mae_after)


class _Everything(_Part):
    gap: _Gap | None = None


class _Trial(_Part):
    kind: Literal["swim", "dry", "free_decay"]
    commanded_hz: Annotated[FiniteFloat, Field(gt=0)] | None = None
    logged: bool = False

    @model_validator(mode="after")
    def _told_a_speed(self) -> "_Trial":
        if (self.kind == "free_decay") != (self.commanded_hz is None):
            raise ValueError("commanded_hz: a speed above 0 of a swim or a dry run, none of a free decay")
        return self


class _Experiment(_Part):
    separates: tuple[str, str]
    trial: _Trial | None = None


class _Contract(_Part):
    verdict: Literal["named", "inseparable", "unexplained", "no_gap"]
    groups: tuple[Annotated[tuple[str, ...], Field(min_length=1, max_length=3)], ...]
    probabilities: dict[str, Annotated[float, Field(ge=0, le=1)]]
    where: _Where | None
    gap: _Gap | None
    everything: _Everything | None = None
    seconds: FiniteFloat | None = None
    effort: str | None = None
    withheld_from_catalogue: tuple[str, ...] | None = None
    next_experiments: tuple[_Experiment, ...] | None = None

    def told(self) -> Told:
        """What scores need of it."""
        gap, by_stage = self.gap or _Gap(), (self.where or _Where()).by_stage or {}
        low, high = gap.shrinkage_ci95 or (None, None)
        trials = ((each, each.trial) for each in self.next_experiments or ())
        groups = self.groups if self.verdict in ("named", "inseparable") else ()
        return Told(
            verdict=self.verdict,
            groups=groups,
            probabilities=self.probabilities,
            by_stage={stage: share for stage, share in by_stage.items() if share is not None},
            shrinkage=gap.shrinkage,
            interval=None if low is None or high is None else (low, high),
            seconds=self.seconds,
            recommended=tuple(
                Recommended(each.separates, trial.kind, trial.commanded_hz, trial.logged)
                for each, trial in trials
                if trial is not None
            ),
            named=gap.forecast if groups else None,
            effort=self.effort,
            together=None if self.everything is None else (self.everything.gap or _Gap()).forecast,
        )
