"""What may be said: a name, a few names that cannot be told apart, that something else is there, or nothing."""

from collections.abc import Collection
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np

from diagnosis.probabilities import Probabilities

VerdictName = Literal["named", "inseparable", "unexplained", "no_gap"]
MOST_ALIKE = 3
SURE = 0.9  # probability from which one name is enough
_LOOKED_AT = 10  # of the likeliest effects, for a group
ALARM = 0.9  # that there is something: below, there is no gap to speak of


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

    def without(self, names: Collection[str]) -> "Verdict":
        """Without those groups whose likeliest has one of these names."""
        return _naming(tuple(group for group in self.groups if group[0] not in names))


def verdict_of(found: Probabilities) -> Verdict:
    """From probabilities.

    A group is the fewest effects, at most three, of which at least one is surely present; there may be several groups,
    which act together. Whatever else may be present is left to the remainder; where there is no group at all the gap is
    unexplained.
    """
    if 1 - found.null < ALARM:
        return Verdict("no_gap", ())
    groups: list[tuple[int, ...]] = []
    while (group := _group(found, groups)) is not None:
        groups.append(group)
    return _naming(tuple(tuple(found.names[i] for i in group) for group in groups))


def _naming(groups: tuple[tuple[str, ...], ...]) -> Verdict:
    if not groups:
        return Verdict("unexplained", ())
    return Verdict("named" if all(len(group) == 1 for group in groups) else "inseparable", groups)


def _group(found: Probabilities, before: list[tuple[int, ...]]) -> tuple[int, ...] | None:
    """Alternatives beside those of the groups before, the likeliest first."""
    taken = {i for group in before for i in group}
    likely = [int(i) for i in np.argsort(-found.marginal) if int(i) not in taken][:_LOOKED_AT]
    for size in range(1, MOST_ALIKE + 1):
        chances = {group: _any(found, group) for group in combinations(likely, size)}
        best = max(chances, key=lambda group: chances[group], default=None)
        if best is not None and chances[best] >= SURE:
            return best
    return None


def _any(found: Probabilities, group: tuple[int, ...]) -> float:
    return sum(chance for (present, _), chance in found.of.items() if set(present) & set(group))
