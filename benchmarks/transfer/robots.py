"""The robots of a withheld suite, made again from their seeds, to be swum with."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np

from benchmarks.effects.drawn import draw_world
from benchmarks.effects.filming import film_together
from benchmarks.effects.folder import SuiteFolder
from benchmarks.effects.generators import GENERATORS
from benchmarks.effects.suite import SessionPlan, suite_named
from benchmarks.reality import Nuisances, World
from benchmarks.reality.mechanism import worn
from benchmarks.reference_swimmers import ReferenceSwimmers
from swimgym import Swimmers

_GENERATOR = GENERATORS["reality"]
_STEP_S = 0.005  # of the integrator; over 1 m of way it is 7 mm from a step five times finer, and 0.02 degrees


@dataclass(frozen=True)
class Robot:
    """One as it truly is, after the trials of its session."""

    coefficients: tuple[float, float, float, float, float]  # of its water
    nuisances: Nuisances  # by which it departs from its description
    used_s: float  # how long its trials took


def plans(seed: int, suite: str) -> dict[str, SessionPlan]:
    """The sessions of a suite, or of a part of one, by name.

    Raises:
        ValueError: there is no such suite.
    """
    size, part = suite_named(suite)
    return {plan.name: plan for plan in _GENERATOR.plan(seed, size)[part]}


def draw_robots(of: Sequence[SessionPlan]) -> dict[str, Robot]:
    """As when their sessions were made."""
    drawn = film_together([draw_world(plan) for plan in of])
    return {
        each.plan.name: Robot(
            each.world.coefficients, each.world.nuisances, float(sum(made.trial.duration_s for made in each.trials))
        )
        for each in drawn
    }


def world_of(robot: Robot, plan: SessionPlan, strengths: Sequence[float]) -> World:
    """With what acts in it, as strong as its answer says, and as worn as its trials left it."""
    random = np.random.default_rng([plan.seed, 3])
    made = [_GENERATOR.mechanisms[name](random) for name in plan.effects]
    acting = [each for strong, strength in zip(made, strengths, strict=True) for each in strong(strength)]
    return World(robot.coefficients, robot.nuisances, worn(acting, robot.used_s))


def load_worlds(suite: SuiteFolder, robots: dict[str, Robot], of: dict[str, SessionPlan]) -> tuple[World, ...]:
    """Of some sessions, in their order; this opens their answers."""
    answers = {answer.session: answer for answer in suite.true()}
    return tuple(world_of(robot, of[name], answers[name].strengths) for name, robot in robots.items())


def in_the_pool(worlds: Sequence[World], times: int) -> Swimmers:
    """Robots to steer, with the members of `Swimmers`: all of them, so many times."""
    return cast(Swimmers, ReferenceSwimmers(list(worlds) * times, step_s=_STEP_S))
