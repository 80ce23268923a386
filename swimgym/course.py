"""The tasks of swimmers, targets and a circle: what they see of them and what their actions are worth.

Everything is an array over n swimmers; the environments of gymnasium are thin shells around it. Following "Simple
Models, Real Swimming" (2026): what is seen, the action (an acceleration of the motor), the reward, the area of the
targets and the distance that counts as reached. What the paper leaves open, or what is decided otherwise here:

- The steered point is the centre of mass of the straight robot, fixed in the head's frame.
- The interval between commands is 20 ms and an episode ends after 80 s.
- The rate of the vector to the target is taken in the pool's axes and then turned into the head's frame.
- The twin is planar: rates of roll and pitch are there, and 0.
- The motor turns both ways, at most 5 turns a second.
- A swimmer starts at rest with a straight tail and the crank at 0.
- On the circle the target leads the swimmer by a fixed arc, so that no speed has to be prescribed; what is scored is
  the distance of the steered point from the circle.
- A simulation that diverges ends its episode; it has no reward of its own.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from swimgym.swimmers import Swimmers, turned

SEEN = ("crank_cos", "crank_sin", "crank_speed", "roll_rate", "pitch_rate", "yaw_rate")
AHEAD = ("distance", "target_x", "target_y", "target_x_rate", "target_y_rate", "last_action")


@dataclass(frozen=True)
class Rules:
    """The rules of action, reward and episode that hold for every task.

    Attributes:
        interval_s: time between two actions.
        acceleration_rad_s2: acceleration of the crank at an action of 1 (paper: 400 to 500).
        fastest_hz: turns of the crank a second, either way; the tail beats as often.
        seconds: time after which an episode is cut off.
        distance_weight, effort_weight: weights of the reward -distance (m) - abs(action), at every action.
        goal_reward: reward when a target is reached.
    """

    interval_s: float = 0.02
    acceleration_rad_s2: float = 450.0
    fastest_hz: float = 5.0
    seconds: float = 80.0
    distance_weight: float = 1.0
    effort_weight: float = 1.0
    goal_reward: float = 300.0

    def __post_init__(self) -> None:
        for name in ("interval_s", "acceleration_rad_s2", "fastest_hz", "seconds"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name}: found {getattr(self, name)!r}, expected a number above 0")

    def speed(self, crank_speed: np.ndarray, action: np.ndarray) -> np.ndarray:
        """Compute the (n,) speeds of the crank, rad/s, that actions (n,) lead to from speeds (n,)."""
        most = 2 * np.pi * self.fastest_hz
        wanted = crank_speed + self.acceleration_rad_s2 * self.interval_s * np.clip(action, -1.0, 1.0)
        return np.clip(wanted, -most, most)


class Task(Protocol):
    """The goal of each of n swimmers, in the pool's frame, m."""

    def begin(self, rows: np.ndarray, rng: np.random.Generator) -> None:
        """Set new goals for some swimmers (r,), which lie at the origin heading along -x."""
        ...

    def ahead(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the (n, 2) targets of swimmers at places (n, 2), and (n, 2) how these move on their own, m/s."""
        ...

    def reached(self, distance: np.ndarray) -> np.ndarray:
        """Return (n,) whether each swimmer has reached its goal, given its distance (n,) from the target."""
        ...

    def off_path(self, place: np.ndarray) -> np.ndarray:
        """Compute the (n,) distances of places (n, 2) from the path; nan without a path."""
        ...


class Targets:
    """A random target for each swimmer, in a rectangle ahead.

    Args:
        count: number of swimmers.
        ahead_m: length of the rectangle, from the start on.
        across_m: its width.
        reach_m: distance within which a target is reached.

    Attributes:
        places: (n, 2) places of the targets, m.
        given_m: (2,), or (r, 2) places of the next r targets, m; None: they are drawn at random.
    """

    def __init__(self, count: int, ahead_m: float = 4.0, across_m: float = 4.0, reach_m: float = 0.05) -> None:
        self.size_m, self.reach_m = np.array([ahead_m, across_m]), reach_m
        self.given_m: np.ndarray | None = None
        self.places = np.zeros((count, 2))

    def begin(self, rows: np.ndarray, rng: np.random.Generator) -> None:
        """Draw targets uniformly, but not where they would be reached at once."""
        if self.given_m is not None:
            self.places[rows] = self.given_m
            return
        drawn, close = np.zeros((len(rows), 2)), np.ones(len(rows), bool)
        while close.any():
            drawn[close] = (rng.random((int(close.sum()), 2)) - [1.0, 0.5]) * self.size_m
            close = np.linalg.norm(drawn, axis=1) <= self.reach_m
        self.places[rows] = drawn

    def ahead(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:  # noqa: ARG002
        """Return the targets, which stand still."""
        return self.places, np.zeros_like(self.places)

    def reached(self, distance: np.ndarray) -> np.ndarray:
        """Return (n,) whether the targets are within reach."""
        return distance <= self.reach_m

    def off_path(self, place: np.ndarray) -> np.ndarray:
        """Return (n,) nan: there is no path."""
        return np.full(len(place), np.nan)


class Circle:
    """A circle through the start, along which it heads at first, to the left or to the right.

    Args:
        count: number of swimmers.
        radius_m: radius of the circle.
        lead_m: arc by which the target is ahead of a swimmer.
        side: 1 to the left, -1 to the right, 0 for either, by chance.
    """

    def __init__(self, count: int, radius_m: float = 1.0, lead_m: float = 0.3, side: int = 0) -> None:
        self.radius_m, self.lead_m, self._given = radius_m, lead_m, side
        self.side, self.progress = np.ones(count), np.zeros(count)  # progress in radians along the circle

    @property
    def middle(self) -> np.ndarray:
        """Centres (n, 2) of the circles, m; left of a swimmer that heads along -x is -y."""
        return np.stack([np.zeros_like(self.side), -self.side * self.radius_m], axis=1)

    def begin(self, rows: np.ndarray, rng: np.random.Generator) -> None:
        """Draw the sides: half of several swimmers to either."""
        even = np.resize([1.0, -1.0], len(rows)) * rng.choice([-1.0, 1.0])
        self.side[rows] = self._given or rng.permutation(even)
        self.progress[rows] = 0.0

    def ahead(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the targets, which lead by their arc and never go back."""
        off = place - self.middle
        angle = np.arctan2(-off[:, 0], self.side * off[:, 1])  # 0 at the start, growing along the circle
        forward = np.mod(angle - self.progress + np.pi, 2 * np.pi) - np.pi
        self.progress += np.clip(forward, 0.0, 0.5)
        goal = self.progress + self.lead_m / self.radius_m
        out = np.stack([-np.sin(goal), self.side * np.cos(goal)], axis=1)
        return self.middle + self.radius_m * out, np.zeros_like(place)

    def reached(self, distance: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """Return (n,) whether the swimmers have been once around."""
        return self.progress >= 2 * np.pi

    def off_path(self, place: np.ndarray) -> np.ndarray:
        """Compute the (n,) distances of places (n, 2) from the circle, m."""
        return np.abs(np.linalg.norm(place - self.middle, axis=1) - self.radius_m)


@dataclass(frozen=True, eq=False)
class Moment:
    """The observations and rewards of n swimmers after an action.

    Attributes:
        seen: (n, 12 + 2 h) observations, see `Course.names`; SI units.
        reward: (n,) rewards.
        reached, diverged, timed_out: (n,) how an episode ended.
        distance_m, off_path_m: (n,) distances from the target, and from the path (nan without one).
    """

    seen: np.ndarray
    reward: np.ndarray
    reached: np.ndarray
    diverged: np.ndarray
    timed_out: np.ndarray
    distance_m: np.ndarray
    off_path_m: np.ndarray

    @property
    def over(self) -> np.ndarray:
        """Mask (n,), True where the episode ended."""
        return self.reached | self.diverged | self.timed_out


class Course:
    """Swimmers, or an object with their members, with a task: begun again one by one, acted on together."""

    def __init__(self, swimmers: Swimmers, task: Task, rules: Rules) -> None:
        self.swimmers, self.task, self.rules = swimmers, task, rules
        self.action, self.time_s = np.zeros(len(swimmers)), np.zeros(len(swimmers))
        hinges = swimmers.hinges
        self.names = (*SEEN, *hinges, *(f"{name}_rate" for name in hinges), *AHEAD)
        """Names of the numbers that a swimmer sees; 22 with five hinges. Vectors are in the head's frame."""

    def begin(self, rows: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Begin the episodes of some swimmers (r,) anew, and return (n, o) what all see."""
        self.swimmers.rest(rows)
        self.action[rows] = self.time_s[rows] = 0.0
        self.task.begin(rows, rng)
        return self.look()[0]

    def look(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return (n, o) what the swimmers see, and their distances (n,) from targets and (n,) from paths, m."""
        swimmers = self.swimmers
        angle, speed = swimmers.crank
        place, moving = swimmers.centre
        target, carried = self.task.ahead(place)
        yaw = swimmers.head[:, 2]
        vector, rate = turned(target - place, -yaw), turned(carried - moving, -yaw)
        distance = np.sqrt((vector**2).sum(axis=1))
        own = [np.stack([np.cos(angle), np.sin(angle), speed], axis=1), swimmers.turn_rates, *swimmers.tail]
        seen = np.hstack([*own, distance[:, None], vector, rate, self.action[:, None]])
        return seen, distance, self.task.off_path(place)

    def act(self, action: np.ndarray, rows: np.ndarray | None = None) -> Moment:
        """Accelerate the cranks by actions (n,) in [-1, 1] and swim for one interval.

        With rows (r,) only those move; the others stay as they are.
        """
        rules = self.rules
        self.action = np.clip(np.asarray(action, float), -1.0, 1.0)
        self.swimmers.drive(rules.speed(self.swimmers.crank[1], self.action), rows)
        self.time_s[slice(None) if rows is None else rows] += rules.interval_s
        seen, distance, off_path = self.look()
        diverged = self.swimmers.diverged
        reached = self.task.reached(distance) & ~diverged
        timed_out = (self.time_s >= rules.seconds - rules.interval_s / 2) & ~reached & ~diverged
        reward = -rules.distance_weight * distance - rules.effort_weight * np.abs(self.action)
        reward = np.where(diverged, 0.0, reward + rules.goal_reward * reached)
        return Moment(np.where(diverged[:, None], 0.0, seen), reward, reached, diverged, timed_out, distance, off_path)
