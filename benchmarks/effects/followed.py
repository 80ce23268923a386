"""Whether what a diagnosis recommends helps: the trial is made, and the session diagnosed with it once more."""

from dataclasses import dataclass
from typing import Any, NamedTuple

from benchmarks.effects.answer import Answer
from benchmarks.effects.score import Share
from benchmarks.effects.told import Recommended, Told


class Confused(NamedTuple):
    """An effect that is there and told as one of several, and the trial that is to tell it from them.

    Attributes:
        effect: its name.
        trial: the first that was recommended of those that can be made, whichever two of the group it is to separate:
            nobody who follows it knows which of them is there.
    """

    effect: str
    trial: Recommended


def confused(answer: Answer, told: Told) -> Confused | None:
    """What a diagnosis leaves confused, and what it wants to see for it; None where there is no such thing."""
    for group in told.groups:
        present = [name for name in group if answer.present(name)]
        wanted = [each for each in told.recommended if each.separates <= set(group)]
        if len(group) > 1 and present and wanted:
            return Confused(present[0], wanted[0])
    return None


@dataclass(frozen=True)
class FollowedScore:
    """Of sessions with the trial that their diagnosis recommended.

    Attributes:
        effects: that were confused, one a session.
        told: of each session with the trial.
        missing: sessions that should have been followed and were not.
    """

    effects: tuple[str, ...]
    told: tuple[Told, ...]
    missing: int = 0

    @property
    def headline(self) -> dict[str, Share]:
        """How often the effect now stands alone, and how often it is gone."""
        pairs = list(zip(self.effects, self.told, strict=True))
        return {
            "told_apart": Share(sum((effect,) in told.groups for effect, told in pairs), len(pairs)),
            "lost": Share(sum(effect not in told.names for effect, told in pairs), len(pairs)),
        }

    def to_json(self) -> dict[str, Any]:
        """Plain numbers."""
        return {
            "sessions": len(self.told),
            "missing": self.missing,
            "headline": {name: share.to_json() for name, share in self.headline.items()},
            "effects": sorted(self.effects),
        }
