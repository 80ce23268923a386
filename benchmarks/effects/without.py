"""How right diagnoses are whose catalogue lacked the effect that is there: no name that they tell can be."""

from dataclasses import dataclass
from typing import Any

from benchmarks.effects.score import Case, Score, Share, clear


@dataclass(frozen=True)
class WithoutScore:
    """Of sessions with one effect, diagnosed by a catalogue that lacked it.

    From a detectability of five on no other effect follows it: from there `unexplained` is asked for, and the stage.

    Attributes:
        score: that counts them.
    """

    score: Score

    @property
    def headline(self) -> dict[str, Share]:
        """What is asked of such diagnoses."""
        return {
            "unexplained": self.score.share(_unexplained, clear),
            "stage_right": self.score.share(lambda c: c.told.stage == c.answer.stage, clear),
            "confident_wrong": self.score.share(lambda c: c.confidently_wrong),
        }

    @property
    def by_detectability(self) -> dict[float, Share]:
        """`unexplained`, by how detectable the effect is."""
        return self.score.shares_by_detectability(_unexplained)

    @property
    def by_effect(self) -> dict[str, Share]:
        """`unexplained`, by clear effect."""
        return self.score.shares_by_effect(_unexplained)

    def to_json(self) -> dict[str, Any]:
        """Plain numbers."""
        return {
            "sessions": len(self.score.cases),
            "headline": {name: share.to_json() for name, share in self.headline.items()},
            "by_detectability": {f"{level:g}": share.to_json() for level, share in self.by_detectability.items()},
            "by_effect": {name: share.to_json() for name, share in self.by_effect.items()},
            "named_instead": self.score.confusion,
        }


def _unexplained(case: Case) -> bool:
    return case.told.verdict == "unexplained"
