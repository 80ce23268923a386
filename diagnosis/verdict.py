"""What may be said: a name, a few names that cannot be told apart, that something else is there, or nothing."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from diagnosis.probabilities import Probabilities

VerdictName = Literal["named", "inseparable", "unexplained", "no_gap"]
MOST_ALIKE = 3
SURE = 0.9  # probability from which one name is enough
ALARM = 0.97  # that there is something: below, there is no gap to speak of


@dataclass(frozen=True)
class Verdict:
    """What is said.

    Attributes:
        name: of the verdict.
        groups: alternatives (inner), the likeliest first, that act together (outer).
    """

    name: VerdictName
    groups: tuple[tuple[str, ...], ...]

    @property
    def effects(self) -> tuple[str, ...]:
        """All that are named, each once."""
        return tuple(dict.fromkeys(name for group in self.groups for name in group))

    @property
    def first(self) -> tuple[str, ...]:
        """The likeliest of each group."""
        return tuple(group[0] for group in self.groups)


def verdict_of(found: Probabilities) -> Verdict:
    """From probabilities: the likeliest explanation, with what may stand in the place of each of its effects."""
    if 1 - found.null < ALARM:
        return Verdict("no_gap", ())
    named = sum(chance for (present, _), chance in found.of.items() if present)
    if found.other > named:
        return Verdict("unexplained", ())
    present = max((key for key in found.of if key[0]), key=lambda key: found.of[key])[0]
    groups = [_alternatives(found, present, place) for place in present]
    if any(not group for group in groups):
        return Verdict("unexplained", ())
    names = tuple(tuple(found.names[i] for i in group) for group in groups)
    return Verdict("named" if all(len(group) == 1 for group in groups) else "inseparable", names)


def _alternatives(found: Probabilities, present: tuple[int, ...], place: int) -> tuple[int, ...]:
    """An effect of an explanation and what may stand in its place, as many as make it sure; none where too many do."""
    rest = set(present) - {place}
    chances = np.zeros(len(found.names))
    for (others, _), chance in found.of.items():
        if rest <= set(others):
            for i in set(others) - rest:
                chances[i] += chance / len(set(others) - rest)
    chances /= max(chances.sum(), 1e-300)
    order = [int(i) for i in np.argsort(-chances)]
    needed = int(np.searchsorted(np.cumsum(chances[order]), SURE)) + 1
    if needed > MOST_ALIKE and chances[order[:MOST_ALIKE]].sum() < SURE - 0.2:
        return ()
    return tuple(order[: min(needed, MOST_ALIKE)])
