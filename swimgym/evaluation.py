"""The scores of a controller on a course: targets reached, with an interval, and distances from a path."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import binomtest

from session.errors import Fault, InputError
from session.results import writing_whole
from swimgym.course import Course, Targets

FARTHEST_M = 50.0
_DRAWN = 48  # episodes whose paths are kept
_EVERY = 5  # actions from one point of a kept path to the next
Controller = Callable[[np.ndarray], np.ndarray]
"""A function from what n swimmers see (n, o) to what they do (n,)."""


@dataclass(frozen=True, eq=False)
class Swum:
    """The outcome of n episodes.

    Attributes:
        reached, diverged: (n,) how they ended; neither: out of time.
        seconds: (n,) how long they lasted.
        off_path_m: (n,) mean and (n,) largest distance of the steered point from the path; nan without one.
        nearest_m: (n,) smallest distance from the target.
        start_m: (n, 2) first target, seen from the start.
        path: (k, n, 2) the steered point after every action, m; nan once an episode is over.
    """

    reached: np.ndarray
    diverged: np.ndarray
    seconds: np.ndarray
    off_path_m: tuple[np.ndarray, np.ndarray]
    nearest_m: np.ndarray
    start_m: np.ndarray
    path: np.ndarray

    def scores(self) -> dict[str, float | int | list[float]]:
        """Compute the scores as a card or a table has them."""
        reached, low, high = share(self.reached)
        told: dict[str, float | int | list[float]] = {
            "episodes": len(self.reached),
            "reached": reached,
            "reached_ci95": [low, high],
            "diverged": int(self.diverged.sum()),
            "median_s": float(np.median(self.seconds[self.reached])) if self.reached.any() else float("nan"),
        }
        if np.isfinite(self.off_path_m[0]).any():
            told |= {
                "off_path_mean_m": float(np.mean(self.off_path_m[0])),
                "off_path_max_m": float(np.max(self.off_path_m[1])),
            }
        return told

    def save(self, file: Path) -> None:
        """Save the arrays under these names (npz); of the paths those of the first episodes, every 0.1 s.

        Raises:
            ResultsNotWritable: it cannot be written.
        """
        arrays = {**vars(self), "path": self.path[::_EVERY, :_DRAWN].astype(np.float32)}
        with writing_whole(file) as part:
            np.savez_compressed(part, allow_pickle=False, **{name: np.asarray(each) for name, each in arrays.items()})


def swim(course: Course, controller: Controller, seed: int = 0) -> Swum:
    """Simulate one episode of each swimmer; a swimmer whose episode is over costs no more time.

    Args:
        course: the swimmers with their task.
        controller: steers them.
        seed: draws the goals.
    """
    count, rng = len(course.swimmers), np.random.default_rng(seed)
    seen = course.begin(np.arange(count), rng)
    start = course.task.ahead(course.swimmers.centre[0])[0].copy()
    reached, diverged, seconds = np.zeros(count, bool), np.zeros(count, bool), np.zeros(count)
    total, largest, nearest = np.zeros(count), np.zeros(count), np.full(count, np.inf)
    live, path = np.arange(count), []
    while live.size:
        moment = course.act(controller(seen), live)
        seen = moment.seen
        total[live] += moment.off_path_m[live] * course.rules.interval_s
        largest[live] = np.maximum(largest[live], moment.off_path_m[live])
        nearest[live] = np.fmin(nearest[live], moment.distance_m[live])
        path.append(np.full((count, 2), np.nan))
        path[-1][live] = course.swimmers.centre[0][live]
        ended = live[moment.over[live]]
        reached[ended], diverged[ended] = moment.reached[ended], moment.diverged[ended]
        seconds[ended] = course.time_s[ended]
        live = live[~moment.over[live]]
    return Swum(reached, diverged, seconds, (total / seconds, largest), nearest, start, np.array(path))


def reach(course: Course, controller: Controller, target_m: tuple[float, float] | None, seed: int = 0) -> Swum:
    """Simulate one episode of one swimmer.

    Args:
        course: one swimmer with its task.
        controller: steers it.
        target_m: x and y of the target from the start, m, the robot heading along -x; None: the task's own.
        seed: draws the target.

    Raises:
        InputError: the target is no place, or is not reached in the time of an episode.
    """
    if target_m is not None:
        expected = "x and y in m, from 0.05 m to 50 m from the start"
        if not isinstance(course.task, Targets) or not course.task.reach_m < np.hypot(*target_m) < FARTHEST_M:
            found, step = f"{target_m[0]:g}, {target_m[1]:g}", "The robot starts at 0, 0 heading along -x."
            raise InputError([Fault("target", "", "no target to swim to", found, expected, next_step=step)])
        course.task.given_m = np.array(target_m)
    swum = swim(course, controller, seed)
    if not swum.reached[0]:
        x, y = swum.start_m[0]
        found = f"{swum.nearest_m[0]:.2f} m away at the nearest, in {swum.seconds[0]:.0f} s"
        step = "Choose a nearer target, or a policy that was trained for longer."
        raise InputError([Fault("target", f"{x:g}, {y:g}", "out of reach of this policy", found, "reached", (), step)])
    return swum


def share(hits: np.ndarray, level: float = 0.95) -> tuple[float, float, float]:
    """Compute the share of hits (n,), and Wilson's interval (J. Am. Stat. Assoc. 22, 1927)."""
    low, high = binomtest(int(np.sum(hits)), len(hits)).proportion_ci(level, method="wilson")
    return float(np.mean(hits)), float(low), float(high)
