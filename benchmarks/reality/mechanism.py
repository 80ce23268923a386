"""Mechanism: the five places at which the second simulator can be made to differ from its base state.

A mechanism is a frozen dataclass of numbers whose class overrides what it needs of `Mechanism`. All simulations of a
batch with the same mechanism are handled together: in the hooks of a running simulation (start, advance, force, turn,
water) each number is an array (n, 1). Fields that are no numbers stay what they are; where they differ, mechanisms are
handled apart.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from numbers import Number
from typing import dataclass_transform

import numpy as np

from benchmarks.reality.camera import Picture, Sight
from benchmarks.reality.fluid import StripForces
from benchmarks.reality.instant import Instant, rows_of
from benchmarks.reality.layout import Layout
from benchmarks.reality.parameters import Parameters
from benchmarks.reality.tendons import Turn


@dataclass_transform(frozen_default=True)
@dataclass(frozen=True)
class Mechanism:
    """Base of all mechanisms, frozen dataclasses by that; it does nothing. Its own state is (n, k), here with k = 0.

    What the hooks of a running simulation are shown is that of all: they answer with arrays of their own.
    """

    def __init_subclass__(cls, *, kw_only: bool = False) -> None:
        dataclass(frozen=True, kw_only=kw_only)(cls)

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:  # noqa: ARG002
        """Change the parameters (one row) of a simulation before it starts: place 1."""
        return parameters

    def start(self, now: Instant) -> np.ndarray:
        """Return the (n, k) own state at the start."""
        return np.zeros((len(now.time_s), 0))

    def advance(self, now: Instant, state: np.ndarray, step_s: float) -> np.ndarray:  # noqa: ARG002
        """Return the (n, k) own state a step later; in between it is constant."""
        return state

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:
        """Return the (n, N) generalised force that comes on top: place 2."""
        raise NotImplementedError

    def turn(self, time_s: np.ndarray, turn: Turn, state: np.ndarray) -> Turn:
        """Return how the crank turns at times (n, 1), in place of what was asked of it: place 3."""
        raise NotImplementedError

    def water(self, now: Instant, forces: StripForces, state: np.ndarray) -> StripForces:
        """Return the forces of the water on the strips, in place of the quasi-steady ones: place 4."""
        raise NotImplementedError

    def expose(self, time_s: np.ndarray) -> np.ndarray:
        """Return (f,) when light fell on frames stamped with times (f,), s; not before the start: place 5a."""
        return time_s

    def place(self, sight: Sight) -> Sight:
        """Move the markers of one simulation in the pool before they are seen: place 5b."""
        return sight

    def picture(self, picture: Picture) -> Picture:
        """Change what the camera made of them, times and pixels: place 5c."""
        return picture


AtStrength = Callable[[float], tuple[Mechanism, ...]]
"""Mechanisms at a strength >= 0."""


class Wearing(Mechanism, kw_only=True):
    """Mechanism that begins where the trials before left it: what slackens, slips or breaks does not mend."""

    before_s: float = 0.0  # time that the robot has been in use in this session before the first frame


def worn(mechanisms: Iterable[Mechanism], before_s: float) -> tuple[Mechanism, ...]:
    """Return the mechanisms after a time in use, s; those that do not wear stay as they are."""
    return tuple(replace(each, before_s=before_s) if isinstance(each, Wearing) else each for each in mechanisms)


@dataclass(frozen=True, eq=False)
class Group:
    """One class of mechanism in the rows of a batch that have it."""

    mechanism: Mechanism  # mechanism with a field (r, 1) for each of its numbers
    # (r,) rows of the batch; a slice where they are side by side, whose part of an array costs nothing
    rows: np.ndarray | slice
    parameters: Parameters  # parameters of these rows

    def overrides(self, hook: str) -> bool:
        """Return whether this class does anything there."""
        return getattr(type(self.mechanism), hook) is not getattr(Mechanism, hook)

    @cached_property
    def acts(self) -> bool:
        """Whether this class does anything between two steps that calls for the instant."""
        return any(map(self.overrides, ("force", "water", "advance")))

    def seen(self, now: Instant) -> Instant:
        """Return the instant, its own rows alone."""
        whole = len(self.parameters) == len(now.time_s)
        return now if whole else rows_of(now, self.rows, parameters=self.parameters)


def grouped(mechanisms: Sequence[Sequence[Mechanism]], parameters: Parameters) -> list[Group]:
    """Group mechanisms of n simulations by class and what is no number in them; a second alike gets another group."""
    members: dict[tuple[str, ...], list[tuple[int, Mechanism]]] = {}
    for row, each in enumerate(mechanisms):
        count: Counter[tuple[str, ...]] = Counter()
        for mechanism in each:
            kind = _describe_kind(mechanism)
            members.setdefault((*kind, str(count[kind])), []).append((row, mechanism))
            count[kind] += 1
    groups = []
    for listed in members.values():
        rows = _merge_rows([row for row, _ in listed])
        groups.append(Group(_join([mechanism for _, mechanism in listed]), rows, rows_of(parameters, rows)))
    return groups


def _merge_rows(rows: list[int]) -> np.ndarray | slice:
    """Return rows in rising order, as a slice where none is left out."""
    first, beyond = rows[0], rows[-1] + 1
    return slice(first, beyond) if beyond - first == len(rows) else np.array(rows)


def _describe_kind(mechanism: Mechanism) -> tuple[str, ...]:
    others = [getattr(mechanism, f.name) for f in fields(mechanism) if not _is_number(getattr(mechanism, f.name))]
    return (type(mechanism).__module__, type(mechanism).__qualname__, *map(repr, others))


def _join(mechanisms: list[Mechanism]) -> Mechanism:
    numbers = [f.name for f in fields(mechanisms[0]) if _is_number(getattr(mechanisms[0], f.name))]
    columns = {name: np.array([getattr(mechanism, name) for mechanism in mechanisms])[:, None] for name in numbers}
    return replace(mechanisms[0], **columns)


def _is_number(value: object) -> bool:
    return isinstance(value, Number | np.bool_)
