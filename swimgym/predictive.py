"""Control by prediction, without training: the twin tries many beats ahead and follows what weighs best.

Model predictive path integral control (Williams et al., IEEE Trans. Robot. 34, 2018) on the batched twin: every plan is
a sequence of beats (frequency and side), each kept for one interval of planning.
"""

from dataclasses import dataclass

import numpy as np

from swimgym.beat import beat_action
from swimgym.course import Circle, Course, Targets
from swimgym.source import Fish
from swimgym.swimmers import Swimmers


@dataclass(frozen=True)
class Outlook:
    """How far and how widely is looked ahead.

    Attributes:
        plans, beats: tried for each swimmer, and in a plan.
        hold: intervals of the course for which a beat is kept, and after which is planned anew.
        spread: standard deviation of the trials, of frequency and side from -1 to 1.
        sharpness: weight of a plan is exp(-sharpness times its cost in standard deviations above the best).
        turning_m: radius that the way to go beyond a plan is reckoned with.
        cruise_m_s: what a second is worth, m.
        off_weight: of the mean distance from a path, beside the progress along it.
    """

    plans: int = 48
    beats: int = 8
    hold: int = 15
    spread: tuple[float, float] = (0.2, 0.5)
    sharpness: float = 5.0
    turning_m: float = 0.9
    cruise_m_s: float = 0.3
    off_weight: float = 30.0


class Predictive:
    """A controller of the n swimmers of a course; a `Controller` that also remembers its plans.

    The course's state is read, and never changed; the fish that predicts need not be the one that swims.
    """

    def __init__(
        self, course: Course, fish: Fish, outlook: Outlook | None = None, *, seed: int = 0, workers: int = 0
    ) -> None:
        self.course, self.outlook, self._rng = course, outlook or Outlook(), np.random.default_rng(seed)
        count = len(course.swimmers)
        self._many = Swimmers(
            fish.models[:1], count * self.outlook.plans, interval_s=course.rules.interval_s, workers=workers
        )
        self._plan = np.zeros((count, self.outlook.beats, 2))
        self._plan[..., 0] = 0.3
        self._left, self._planned_s = 0, np.full(count, -1.0)

    def __call__(self, seen: np.ndarray) -> np.ndarray:
        """(n,) accelerations in [-1, 1]."""
        if self._left == 0:
            self._plan_anew()
            self._left = self.outlook.hold
        self._left -= 1
        return self._beat(seen, self._plan[:, 0])

    def _beat(self, seen: np.ndarray, beat: np.ndarray) -> np.ndarray:
        rules = self.course.rules
        return beat_action(rules, seen, rules.fastest_hz * (1 + beat[:, 0]) / 2, beat[:, 1])

    def _plan_anew(self) -> None:
        """Of the swimmers that have moved since the last plan; the others are done."""
        look, count = self.outlook, len(self._plan)
        live = np.flatnonzero(self.course.time_s != self._planned_s)
        self._planned_s = self.course.time_s.copy()
        if self.course.time_s.any():
            self._plan = np.concatenate([self._plan[:, 1:], self._plan[:, -1:]], axis=1)
        noise = self._rng.standard_normal((count, look.plans, look.beats, 2)) * look.spread
        noise[:, : look.plans // 2] = np.cumsum(noise[:, : look.plans // 2], axis=2)  # half of them wander off
        noise[:, 0] = 0.0
        tried = np.clip(self._plan[:, None] + noise, -1.0, 1.0)
        rows = (live[:, None] * look.plans + np.arange(look.plans)).ravel()
        cost = self._cost(tried.reshape(-1, look.beats, 2), rows).reshape(count, look.plans)
        scale = np.std(cost, axis=1, keepdims=True) + 1e-9
        weight = np.exp(-look.sharpness * (cost - cost.min(axis=1, keepdims=True)) / scale)
        weight /= weight.sum(axis=1, keepdims=True)
        self._plan = (weight[..., None, None] * tried).sum(axis=1)

    def _cost(self, tried: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """(n k,) of plans (n k, b, 2) from where the swimmers are now, m; only of some (r,) it means something."""
        look, plans = self.outlook, self.outlook.plans
        course = Course(self._many, _copied(self.course.task, plans), self.course.rules)
        self._many.put(np.repeat(self.course.swimmers.state, plans, axis=0))
        seen = course.look()[0]
        off, took, done = np.zeros(len(tried)), np.zeros(len(tried)), np.zeros(len(tried), bool)
        start = _along(course, look, seen)
        for beat in range(look.beats):
            for _ in range(look.hold):
                moment = course.act(self._beat(seen, tried[:, beat]), rows)
                seen = moment.seen
                done |= moment.reached
                took += ~done
                off += np.nan_to_num(moment.off_path_m)
        to_go = np.where(done, 0.0, _along(course, look, seen))
        cost = look.off_weight * off / (look.beats * look.hold) + to_go - start
        cost += look.cruise_m_s * took * course.rules.interval_s
        return np.where(self._many.diverged | ~np.isfinite(cost), 1e3, cost)


def _copied(task: object, times: int) -> Targets | Circle:
    """The task with each swimmer's goal so many times."""
    copied = object.__new__(type(task))
    counted = len(task.places if isinstance(task, Targets) else task.side)  # type: ignore[attr-defined]
    for name, value in vars(task).items():
        of_each = isinstance(value, np.ndarray) and name in ("places", "side", "progress") and len(value) == counted
        setattr(copied, name, np.repeat(value, times, axis=0) if of_each else value)
    return copied  # type: ignore[return-value]


def _along(course: Course, look: Outlook, seen: np.ndarray) -> np.ndarray:
    """(n,) the way still to go, m: around the circle, or to a target on a path of bounded curvature."""
    if isinstance(course.task, Circle):
        return course.task.radius_m * (2 * np.pi - course.task.progress)
    ahead, aside = -seen[:, -5], np.abs(seen[:, -4])
    radius = look.turning_m
    from_middle = np.hypot(ahead, aside - radius)
    tangent = np.sqrt(np.maximum(from_middle**2 - radius**2, 0.0))
    turned = np.arctan2(ahead, radius - aside) - np.arccos(np.minimum(radius / np.maximum(from_middle, 1e-9), 1.0))
    outside = radius * np.mod(turned, 2 * np.pi) + tangent
    return np.where(from_middle >= radius, outside, 2 * np.pi * radius + 3 * (radius - from_middle))
