"""Steering laws for several robots at a time: searched on models of them, tested on the robots.

All searches of a task are alike: they begin at the law that is shipped, and candidates swim the same episodes.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from swimgym import Circle, Course, Rules, Targets
from swimgym.evaluation import Swum, swim
from swimgym.policy import SHIPPED, load_policy
from swimgym.steering import start_of, steered
from swimgym.swimmers import Swimmers

GENERATIONS, CANDIDATES = 6, 12
LAP_S, SLOW_M = 60.0, 0.3  # a lap is to take no longer; what one pays that does not move
_LARGEST_WEIGHT = 0.3  # of the largest distance from the circle, beside the mean
_WIDTH = 0.4  # of a search from scratch, how widely one looks about the shipped law
_ELITE, _LEAST_WIDTH = 3, 0.02
_TEST_SEED = 1_000_003
_ASKEW_RAD = 0.2  # heading at the start, either way

Make = Callable[[int, int, int], Swimmers]
"""Swimmers of a generation, given numbers of episodes and candidates: rows are episodes x candidates x robots."""


@dataclass(frozen=True)
class TaskPlan:
    """What a law is searched for, and how it is tested."""

    episodes: int  # of a candidate in each generation
    seconds: float  # of each
    tested: int  # episodes
    test_s: float  # each at most


TASKS = {"circle": TaskPlan(2, 25.0, 4, 80.0), "target": TaskPlan(4, 40.0, 12, 60.0)}
"""A circle of 1 m, to either side; targets in 4 m x 4 m ahead."""


@dataclass(frozen=True)
class OnRobot:
    """A law on the robot that it is for."""

    law: tuple[float, ...]
    promised: float  # its cost on the model that it was searched on, m; nan without one
    reached: tuple[bool, ...]  # by episode: once around, or at the target, in time
    off_m: tuple[float, ...]  # by episode: mean distance from the circle, m; nan without one
    seconds: tuple[float, ...]  # by episode


class _Episodes(Course):
    """Starts and targets that are the same for all that are compared: rows are episodes x whatever is compared."""

    def __init__(self, swimmers: Swimmers, task: str, episodes: int, seconds: float, seed: int) -> None:
        goal = Circle(len(swimmers)) if task == "circle" else Targets(len(swimmers))
        super().__init__(swimmers, goal, Rules(seconds=seconds))
        each, random = len(swimmers) // episodes, np.random.default_rng(seed)
        if isinstance(goal, Circle):
            self._heading_rad = np.repeat(random.uniform(-_ASKEW_RAD, _ASKEW_RAD, episodes), each)
            self._side = np.repeat(np.resize([1.0, -1.0], episodes), each)
        else:
            drawn = Targets(episodes)
            drawn.begin(np.arange(episodes), random)
            self._places = np.repeat(drawn.places, each, axis=0)

    def begin(self, rows: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        super().begin(rows, rng)
        if isinstance(self.task, Circle):
            self.swimmers.rest(rows, heading_rad=self._heading_rad[rows])
            self.task.side[rows] = self._side[rows]
        elif isinstance(self.task, Targets):
            self.task.places[rows] = self._places[rows]
        return self.look()[0]

    def swum(self, laws: np.ndarray) -> Swum:
        """By laws (n, p)."""
        return swim(self, lambda seen: steered(laws, self.rules, seen))

    def costs(self, laws: np.ndarray) -> np.ndarray:
        """(n,) of laws (n, p): m off the circle, and behind the pace of a lap in time; or time that a target takes.

        That as a share of the episode, and where it is not reached by how far the swimmer stays away, over its way.
        """
        swum, seconds = self.swum(laws), self.rules.seconds
        if isinstance(self.task, Circle):
            mean, largest = swum.off_path_m
            share = self.task.progress / (2 * np.pi * seconds / LAP_S)
            cost = mean + _LARGEST_WEIGHT * largest + SLOW_M * np.clip(1 - share, 0.0, 1.0)
        else:
            left = swum.nearest_m / np.linalg.norm(swum.start_m, axis=1)
            cost = np.where(swum.reached, swum.seconds / seconds, 1.0 + left)
        return np.where(np.isfinite(cost), cost, 10.0)


def shipped_law(task: str) -> np.ndarray:
    """(p,) the law of the sample session."""
    return load_policy(SHIPPED / task).arrays["law"]


def searched(make: Make, task: str, robots: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """(r, p) the best law of the last generation for each robot, and (r,) its cost, by the cross-entropy method."""
    first, plan = shipped_law(task), TASKS[task]
    middle, width = np.tile(first, (robots, 1)), _WIDTH * start_of(task, len(first) - 8)[1]
    for generation in range(GENERATIONS):
        random = np.random.default_rng([seed, generation])
        laws = middle + width * random.standard_normal((CANDIDATES, *middle.shape))
        laws[0] = middle
        swimmers = make(generation, plan.episodes, CANDIDATES)
        swum = _Episodes(swimmers, task, plan.episodes, plan.seconds, 100 * seed + generation)
        costs = swum.costs(np.tile(laws.reshape(-1, len(first)), (plan.episodes, 1)))
        costs = costs.reshape(plan.episodes, CANDIDATES, robots).mean(axis=0)
        best = np.take_along_axis(laws, np.argsort(costs, axis=0)[:_ELITE, :, None], axis=0)
        middle, width = best.mean(axis=0), np.maximum(best.std(axis=0), _LEAST_WIDTH)
    return best[0], costs.min(axis=0)


def tested(
    swimmers: Callable[[int], Swimmers], task: str, laws: np.ndarray, promised: np.ndarray
) -> tuple[OnRobot, ...]:
    """Laws (r, p) that promise costs (r,), each on its robot, from starts that no search saw."""
    plan = TASKS[task]
    course = _Episodes(swimmers(plan.tested), task, plan.tested, plan.test_s, _TEST_SEED)
    swum = course.swum(np.tile(laws, (plan.tested, 1)))
    reached, off_m, seconds = (
        np.reshape(of, (plan.tested, -1)).T.tolist() for of in (swum.reached, swum.off_path_m[0], swum.seconds)
    )
    return tuple(
        OnRobot(tuple(laws[r].tolist()), float(promised[r]), tuple(reached[r]), tuple(off_m[r]), tuple(seconds[r]))
        for r in range(len(laws))
    )
