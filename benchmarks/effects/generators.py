"""Generators of the sessions of a suite: the second simulator, or the one whose swimmer sheds its wake."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from benchmarks import reality, wake
from benchmarks.effects.drawn import DrawnWorld, draw_swim, draw_world, sample_world, swims_forward
from benchmarks.effects.filming import Filming, Simulate
from benchmarks.effects.severity import Strong
from benchmarks.effects.suite import SessionPlan, SuiteSize, plan_suite
from benchmarks.reality import Recording, Trial, World
from benchmarks.reality.mechanisms import CATALOGUED, EVERY, OUTSIDE
from benchmarks.wake.mechanisms import CATALOGUED as IN_WAKES
from benchmarks.wake.suite import draw_wake_swim, draw_wake_world, is_plausible, plan_wake_suite, sample_wake_world


@dataclass(frozen=True)
class Generator:
    """Way in which sessions come about."""

    plan: Callable[[int, SuiteSize], tuple[SessionPlan, ...]]  # plans the sessions of a seed
    draw: Callable[[SessionPlan], Filming[DrawnWorld]]  # draws a session before anything acts
    simulate: Simulate
    mechanisms: Mapping[str, Callable[[np.random.Generator], Strong]]  # mechanisms of the catalogue and others, by name
    world: Callable[[np.random.Generator], World]  # draws robot, water and camera
    swim: Callable[[float, float, np.random.Generator], Trial]  # draws a launch, by frequency and duration
    plausible: Callable[[Recording], bool]  # tells whether a swim of the base state is one


def _plan_reality(seed: int, size: SuiteSize) -> tuple[SessionPlan, ...]:
    return plan_suite(seed, size, tuple(name for name in CATALOGUED if name not in size.without), tuple(OUTSIDE))


GENERATORS: Mapping[str, Generator] = {
    "reality": Generator(_plan_reality, draw_world, reality.simulate, EVERY, sample_world, draw_swim, swims_forward),
    "wake": Generator(
        plan_wake_suite, draw_wake_world, wake.simulate, IN_WAKES, sample_wake_world, draw_wake_swim, is_plausible
    ),
}
