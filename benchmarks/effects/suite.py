"""Plan of a suite: what is present in each session, how strong, and what was recorded; nothing is simulated here.

What was recorded is drawn before, and independently of, what is present: only the tracks contain information on it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import cycle, islice
from re import fullmatch
from typing import Literal

import numpy as np

from benchmarks.effects.folder import Kind

DETECTABILITIES = (1.0, 2.0, 3.3, 5.0, 10.0)  # An effect is made as strong as one of these asks for.
SLOWEST_HZ = 0.4
FASTEST_HZ = 1.4
APART_HZ = 0.08  # Commanded speeds differ by at least this much.
# Shares of the sessions with something in them; the remaining ones hold what is outside the catalogue.
_SINGLE_SHARE = 0.6
_DOUBLE_SHARE = 0.2
# The slowest swim makes this many beats after warm-up, as the first half of a held-out trial may be looked at.
BEATS = 3.0
WARMUP_S = 1.0
# Shares of the sessions with a dry run, with a free decay, with a log of the motor.
_DRY_SHARE = 0.4
_DECAY_SHARE = 0.4
_LOG_SHARE = 0.4
Present = tuple[Kind, tuple[str, ...], float]
"""Kind, effects and detectability of a session."""


@dataclass(frozen=True)
class Recorded:
    """Recordings that a session holds."""

    # fit_hz, holdout_hz: commanded speeds of its swims, turns a second
    fit_hz: tuple[float, ...]
    holdout_hz: tuple[float, ...]
    seconds: float  # duration of each swim
    dry_hz: float | None  # speed of the dry run; None without one
    free_decay: bool  # whether a free decay is recorded
    logged: bool  # whether the motor is logged

    @property
    def swims(self) -> list[tuple[float, str]]:
        """Commanded speed and role of each swim, the slowest first."""
        return sorted([*((hz, "fit") for hz in self.fit_hz), *((hz, "holdout") for hz in self.holdout_hz)])


@dataclass(frozen=True)
class SessionPlan:
    """One session of a suite."""

    name: str  # name, which carries no information
    seed: int  # seed of all that is drawn for it: robot, water, markers, camera, noise
    recorded: Recorded  # recordings that it holds
    kind: Kind  # kind of what is present
    effects: tuple[str, ...] = ()  # names, of the catalogue or, for kind "outside", of something else
    detectability: float = 0.0  # detectability that each effect is made as strong for; 0 of null


@dataclass(frozen=True)
class SuiteSize:
    """Size of a suite: the number of sessions, and what is in them."""

    sessions: int  # number of sessions
    null: int  # number of them with nothing in them
    generator: Literal["reality", "wake"] = "reality"  # generator that makes them; see `making`
    without: tuple[str, ...] = ()  # effects of the catalogue that are in none of them


SIZES = {
    # It is shipped, and stays as it is: without effects that came into the catalogue later.
    "small": SuiteSize(24, 8, without=("linear_drag", "skin_friction", "hull_roll")),
    "large": SuiteSize(700, 300),
    "wake": SuiteSize(40, 14, generator="wake"),
}
WHOLE = slice(None)


def suite_named(text: str) -> tuple[SuiteSize, slice]:
    """Return a size of `SIZES`, and which part of its sessions: all, or of "large:2/10" the second tenth.

    A part is as good a sample as any other, since their order is drawn.

    Raises:
        ValueError: there is no such suite.
    """
    found = fullmatch(rf"({'|'.join(SIZES)})(?::(\d+)/(\d+))?", text)
    number, count = (int(each or 1) for each in found.groups()[1:]) if found else (0, 0)
    if found is None or not 1 <= number <= count:
        raise ValueError(f"found {text!r}, expected {', '.join(SIZES)}, or a part such as large:2/10, its second tenth")
    return SIZES[found[1]], slice(number - 1, None, count)


def plan_suite(
    seed: int, size: SuiteSize, catalogued: Sequence[str], outside: Sequence[str]
) -> tuple[SessionPlan, ...]:
    """Plan the sessions of a suite, in the order of their names.

    Each effect, and each detectability, comes about equally often; the two of a double are drawn at random. Names are
    those of effects of the catalogue that reality can make, and of what else it can make.
    """
    random = np.random.default_rng([seed, 7])
    return plans_of(_draw_present(size, catalogued, outside, random), recorded_by, random)


def plans_of(
    present: Sequence[Present], record: Callable[[np.random.Generator], Recorded], random: np.random.Generator
) -> tuple[SessionPlan, ...]:
    """Plan sessions with these in them, under names that carry no information; `record` draws what is recorded."""
    names, seeds = drawn_names(len(present), random), random.integers(2**31, size=len(present))
    plans = [
        SessionPlan(name, int(own), record(np.random.default_rng([int(own), 1])), *what)
        for name, own, what in zip(names, seeds, present, strict=True)
    ]
    return tuple(sorted(plans, key=lambda plan: plan.name))


def recorded_by(random: np.random.Generator) -> Recorded:
    """Draw what somebody with this robot recorded."""
    swims = int(random.integers(4, 9))
    speeds = apart(swims, SLOWEST_HZ, FASTEST_HZ, random)
    fit = sorted(random.choice(swims, max(2, swims // 2), replace=False))
    held_out = [i for i in range(swims) if i not in fit]
    dry = float(random.uniform(0.5, 1.2)) if random.random() < _DRY_SHARE else None
    return Recorded(
        fit_hz=tuple(float(speeds[i]) for i in fit),
        holdout_hz=tuple(float(speeds[i]) for i in held_out),
        seconds=float(np.round(max(random.uniform(5.0, 8.0), WARMUP_S + BEATS / speeds[0]), 1)),
        dry_hz=None if dry is None else round(dry, 2),
        free_decay=bool(random.random() < _DECAY_SHARE),
        logged=bool(random.random() < _LOG_SHARE),
    )


def apart(count: int, slowest_hz: float, fastest_hz: float, random: np.random.Generator) -> np.ndarray:
    """Draw (count,) speeds to a hundredth of a turn a second, each some way from the next."""
    while True:
        speeds = np.sort(np.round(random.uniform(slowest_hz, fastest_hz, count), 2))
        if (np.diff(speeds) >= APART_HZ).all():
            return speeds


def _draw_present(
    size: SuiteSize, catalogued: Sequence[str], outside: Sequence[str], random: np.random.Generator
) -> list[Present]:
    """Draw what is in each session, in no order."""
    something = size.sessions - size.null
    single, double = round(_SINGLE_SHARE * something), round(_DOUBLE_SHARE * something)
    levels = cycle(random.permutation(DETECTABILITIES))
    found: list[Present] = [("null", (), 0.0)] * size.null
    found += [("single", (name,), float(next(levels))) for name in in_turn(catalogued, single, random)]
    for _ in range(double):
        first, second = random.choice(len(catalogued), 2, replace=False)
        found.append(("double", (catalogued[first], catalogued[second]), float(next(levels))))
    found += [
        ("outside", (name,), float(next(levels))) for name in in_turn(outside, something - single - double, random)
    ]
    return found


def in_turn(names: Sequence[str], count: int, random: np.random.Generator) -> list[str]:
    """Return as many names as asked, each about equally often; which ones come once more is drawn."""
    return list(islice(cycle([names[i] for i in random.permutation(len(names))]), count))


def drawn_names(count: int, random: np.random.Generator) -> list[str]:
    """Draw names of sessions, in no order."""
    drawn: set[str] = set()
    while len(drawn) < count:
        drawn.add(f"w{random.integers(16**8):08x}")
    return [sorted(drawn)[i] for i in random.permutation(count)]
