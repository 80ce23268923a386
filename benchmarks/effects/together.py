"""What all effects at once are worth: how often they are called for, and whether held-out swims are forecast better."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, get_args

from benchmarks.effects.answer import Kind
from benchmarks.effects.score import Case, Score
from benchmarks.effects.shares import Estimate, Share, median
from benchmarks.effects.told import Forecast


@dataclass(frozen=True)
class TogetherScore:
    """Of sessions whose diagnosis may ask for all effects at once (`diagnosis.diagnosis.ALL_AT_ONCE`).

    Speeds are held against what was measured of held-out swims, which no twin was fitted to; but for how often all at
    once are called for, sessions count in which they are.

    Attributes:
        score: that counts them.
    """

    score: Score

    @property
    def called_for(self) -> dict[str, Share]:
        """How often they are called for, by what is present."""
        kinds = {kind: lambda case, kind=kind: case.answer.kind == kind for kind in get_args(Kind)}
        shares = {kind: self.score.share(lambda c: c.told.together is not None, of) for kind, of in kinds.items()}
        return {kind: share for kind, share in shares.items() if share.of}

    @property
    def nearer(self) -> dict[str, Share]:
        """Those whose held-out speeds they forecast better than the plain twin, and than the one with names alone."""
        return {"than_plain": self._nearer(_plain), "than_without": self._nearer(_without)}

    @property
    def speed_errors(self) -> dict[str, Estimate]:
        """Medians of the mean error of held-out speeds, m/s."""
        errors = {"plain": _plain, "without": _without, "together": _together}
        return {what: median([e for e in map(of, self._called) if e is not None]) for what, of in errors.items()}

    @property
    def shrinkage(self) -> Estimate:
        """Median of the shrinkages that are told; nan of none."""
        shrinkages = (_forecast(case).shrinkage for case in self._called)
        return median([each for each in shrinkages if each is not None])

    @cached_property
    def _called(self) -> list[Case]:
        return [case for case in self.score.cases if case.told.together is not None]

    def _nearer(self, other: Callable[[Case], float | None]) -> Share:
        errors = [(_together(case), other(case)) for case in self._called]
        told = [own < others for own, others in errors if own is not None and others is not None]
        return Share(sum(told), len(told))

    def to_json(self) -> dict[str, Any]:
        """Plain numbers."""
        return {
            "called_for": {kind: share.to_json() for kind, share in self.called_for.items()},
            "nearer": {what: share.to_json() for what, share in self.nearer.items()},
            "speed_errors": {what: error.to_json() for what, error in self.speed_errors.items()},
            "shrinkage": self.shrinkage.to_json(),
        }


def _forecast(case: Case) -> Forecast:
    return case.told.together or Forecast()


def _together(case: Case) -> float | None:
    return _forecast(case).speed_after


def _plain(case: Case) -> float | None:
    return _forecast(case).speed_before


def _without(case: Case) -> float | None:
    """Of the twin with names alone, or, where nothing is named, the plain one."""
    return _plain(case) if case.told.named is None else case.told.named.speed_after
