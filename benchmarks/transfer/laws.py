"""Steering laws for several robots at a time: searched on models of them, tested on the robots.

All searches are alike: they begin at the law that is shipped, and every candidate swims a circle to either side.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from swimgym import Circle, Course, Rules
from swimgym.evaluation import Swum, swim
from swimgym.policy import SHIPPED, load_policy
from swimgym.steering import start_of, steered
from swimgym.swimmers import Swimmers

GENERATIONS, CANDIDATES, EPISODES, SECONDS = 6, 12, 2, 25.0
LAP_S, SLOW_M = 60.0, 0.3  # a lap is to take no longer; what one pays that does not move
_LARGEST_WEIGHT = 0.3  # of the largest distance from the circle, beside the mean
_WIDTH = 0.4  # of a search from scratch, how widely one looks about the shipped law
_ELITE, _LEAST_WIDTH = 3, 0.02
_TESTED, TEST_S, _TEST_SEED = 4, 80.0, 1_000_003
_ASKEW_RAD = 0.2  # heading at the start, either way

Make = Callable[[int, int, int], Swimmers]
"""Swimmers of a generation, given numbers of episodes and candidates: rows are episodes x candidates x robots."""


@dataclass(frozen=True)
class OnRobot:
    """A law on the robot that it is for."""

    law: tuple[float, ...]
    promised: float  # its cost on the model that it was searched on, m; nan without one
    lapped: tuple[bool, ...]  # by episode: once around in time
    off_m: tuple[float, ...]  # by episode: mean distance from the circle, m
    seconds: tuple[float, ...]  # by episode


class _Laps(Course):
    """Circles from headings that are the same for all that are compared."""

    def __init__(self, swimmers: Swimmers, episodes: int, seconds: float, seed: int) -> None:
        super().__init__(swimmers, Circle(len(swimmers)), Rules(seconds=seconds))
        each = len(swimmers) // episodes
        heading = np.random.default_rng(seed).uniform(-_ASKEW_RAD, _ASKEW_RAD, episodes)
        self._heading_rad, self._side = np.repeat(heading, each), np.repeat(np.resize([1.0, -1.0], episodes), each)

    def begin(self, rows: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        super().begin(rows, rng)
        self.swimmers.rest(rows, heading_rad=self._heading_rad[rows])
        self.task.side[rows] = self._side[rows]  # type: ignore[attr-defined]
        return self.look()[0]

    def swum(self, laws: np.ndarray) -> Swum:
        """By laws (n, p)."""
        return swim(self, lambda seen: steered(laws, self.rules, seen))


def shipped_law() -> np.ndarray:
    """(p,) the law of the sample session."""
    return load_policy(SHIPPED / "circle").arrays["law"]


def searched(make: Make, robots: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """(r, p) the best law of the last generation for each robot, and (r,) its cost, by the cross-entropy method."""
    first = shipped_law()
    middle, width = np.tile(first, (robots, 1)), _WIDTH * start_of("circle", len(first) - 8)[1]
    for generation in range(GENERATIONS):
        random = np.random.default_rng([seed, generation])
        laws = middle + width * random.standard_normal((CANDIDATES, *middle.shape))
        laws[0] = middle
        laps = _Laps(make(generation, EPISODES, CANDIDATES), EPISODES, SECONDS, 100 * seed + generation)
        costs = _cost(laps, np.tile(laws.reshape(-1, len(first)), (EPISODES, 1)))
        costs = costs.reshape(EPISODES, CANDIDATES, robots).mean(axis=0)
        best = np.take_along_axis(laws, np.argsort(costs, axis=0)[:_ELITE, :, None], axis=0)
        middle, width = best.mean(axis=0), np.maximum(best.std(axis=0), _LEAST_WIDTH)
    return best[0], costs.min(axis=0)


def _cost(laps: _Laps, laws: np.ndarray) -> np.ndarray:
    """(n,) m: off the circle, and behind the pace of a lap in time."""
    mean, largest = laps.swum(laws).off_path_m
    share = laps.task.progress / (2 * np.pi * SECONDS / LAP_S)  # type: ignore[attr-defined]
    cost = mean + _LARGEST_WEIGHT * largest + SLOW_M * np.clip(1 - share, 0.0, 1.0)
    return np.where(np.isfinite(cost), cost, 10.0)


def tested(swimmers: Callable[[int], Swimmers], laws: np.ndarray, promised: np.ndarray) -> tuple[OnRobot, ...]:
    """Laws (r, p) that promise costs (r,), each on its robot, from starts that no search saw."""
    swum = _Laps(swimmers(_TESTED), _TESTED, TEST_S, _TEST_SEED).swum(np.tile(laws, (_TESTED, 1)))
    lapped, off_m, seconds = (
        np.reshape(of, (_TESTED, -1)).T.tolist() for of in (swum.reached, swum.off_path_m[0], swum.seconds)
    )
    return tuple(
        OnRobot(tuple(laws[r].tolist()), float(promised[r]), tuple(lapped[r]), tuple(off_m[r]), tuple(seconds[r]))
        for r in range(len(laws))
    )
