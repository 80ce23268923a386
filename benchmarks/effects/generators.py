"""Generators of the sessions of a suite: the second simulator, or the one whose swimmer sheds its wake."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from benchmarks import reality, wake
from benchmarks.effects.drawn import DrawnWorld, draw_world
from benchmarks.effects.filming import Filming, Simulate
from benchmarks.effects.severity import Strong
from benchmarks.effects.suite import SessionPlan, SuiteSize, plan_suite
from benchmarks.reality.mechanisms import CATALOGUED, EVERY, OUTSIDE
from benchmarks.wake.mechanisms import CATALOGUED as IN_WAKES
from benchmarks.wake.suite import draw_wake_world, plan_wake_suite


@dataclass(frozen=True)
class Generator:
    """Way in which sessions come about."""

    plan: Callable[[int, SuiteSize], tuple[SessionPlan, ...]]  # plans the sessions of a seed
    draw: Callable[[SessionPlan], Filming[DrawnWorld]]  # draws a session before anything acts
    simulate: Simulate
    mechanisms: Mapping[str, Callable[[np.random.Generator], Strong]]  # mechanisms of the catalogue and others, by name


def _plan_reality(seed: int, size: SuiteSize) -> tuple[SessionPlan, ...]:
    return plan_suite(seed, size, tuple(name for name in CATALOGUED if name not in size.without), tuple(OUTSIDE))


GENERATORS: Mapping[str, Generator] = {
    "reality": Generator(_plan_reality, draw_world, reality.simulate, EVERY),
    "wake": Generator(plan_wake_suite, draw_wake_world, wake.simulate, IN_WAKES),
}
