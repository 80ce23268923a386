"""What may be said: a name, a few names that cannot be separated, that something else is there, or nothing."""

from collections.abc import Collection
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from diagnosis.constants import ALARM, BESIDE, ENOUGH, HELD, LOOKED_AT, MOST_ALIKE, MOST_GROUPS
from diagnosis.probabilities import Probabilities
from diagnosis.result import VerdictName


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

    def without(self, names: Collection[str], found: Probabilities) -> "Verdict":
        """Without groups whose likeliest has one of these names.

        Where no group that is left is sure: unexplained, or, of a gap that is not sure without them, no gap.
        """
        groups = tuple(group for group in self.groups if group[0] not in names)
        return _naming(groups, found)


def verdict_of(found: Probabilities) -> Verdict:
    """From probabilities.

    A group is the fewest effects, at most three, one of which the gap surely looks like, if there is one; there may be
    several groups, which act together; beside one that is sure a likely one is enough, and no group stands without a
    sure one. One that may as well be something else which only looks like it is not said.
    Whatever else may be present is left to the remainder; where there is no group at all the gap is unexplained.
    """
    groups: list[tuple[int, ...]] = []
    while len(groups) < MOST_GROUPS and (group := _group(found, groups)) is not None:
        groups.append(group)
    held = tuple(_named(found, group) for group in groups if found.any_present(group) >= HELD)
    return _naming(held, found)


def _named(found: Probabilities, group: tuple[int, ...]) -> tuple[str, ...]:
    return tuple(found.names[i] for i in group)


def _is_sure(found: Probabilities, group: tuple[str, ...]) -> bool:
    """Whether the gap, if there is one, looks like one of a group."""
    return found.any_seen([found.names.index(name) for name in group]) >= ENOUGH * (1 - found.null)


def _naming(groups: tuple[tuple[str, ...], ...], found: Probabilities) -> Verdict:
    if 1 - found.null < ALARM:
        return Verdict("no_gap", ())
    if not any(_is_sure(found, group) for group in groups):
        return Verdict("unexplained", ())
    return Verdict("named" if all(len(group) == 1 for group in groups) else "inseparable", groups)


def _group(found: Probabilities, before: list[tuple[int, ...]]) -> tuple[int, ...] | None:
    """Alternatives beside those of the groups before, the likeliest first."""
    taken = {i for group in before for i in group}
    likely = [int(i) for i in np.argsort(-found.marginal) if int(i) not in taken][:LOOKED_AT]
    for enough in (ENOUGH * (1 - found.null), *([BESIDE] if before else [])):
        for size in range(1, MOST_ALIKE + 1):
            chances = {group: found.any_seen(group) for group in combinations(likely, size)}
            best = max(chances, key=lambda group: chances[group], default=None)
            if best is not None and chances[best] >= enough:
                return best
    return None
