"""Courses: targets and circles, how a fish is steered, and what it is asked.

Everything is an array over n swimmers; the environments of gymnasium are thin shells around it.

A `Task` (`Targets` or `Circle`) decides what swimmers see and what their actions are worth. Following "Simple Models,
Real Swimming" (2026): what is seen, the action (an acceleration of the motor), the reward, the area of the targets and
the distance that counts as reached. What the paper leaves open, or what is decided otherwise here:

- The steered point is the centre of mass of the straight robot, fixed in the head's frame.
- The interval between commands is 20 ms and an episode ends after 80 s.
- The rate of the vector to the target is taken in the pool's axes and then turned into the head's frame.
- The twin is planar: rates of roll and pitch are there, and 0.
- The motor turns both ways, at most 5 turns a second.
- A swimmer starts at rest with a straight tail and the crank at 0.
- On the circle the target leads the swimmer by a fixed arc, so that no speed has to be prescribed; what is scored is
  the distance of the steered point from the circle.
- A simulation that diverges ends its episode; it has no reward of its own.

`beat_action` makes a beat of the tail with one motor from two numbers: how fast it is, and how much to one side. The
crank's angle is the clock: it turns at 2 pi f (1 - s sin(angle)), so the tail lingers on one side and hurries through
the other, which turns the robot. Nothing is remembered between actions.

`steer` is a steering law of a few numbers, which a search can find in minutes: towards the target, in tune with the
beat. How much the beat is to one side is tanh of a weighted sum of the bearing of the target and of numbers that follow
the swing of the head within a beat. No side is preferred: left and right mirror each other. A target within the turning
circle cannot be reached by turning towards it; there the swimmer turns away until it can (as paths of bounded curvature
have to: Dubins, Am. J. Math. 79, 1957).

`make_course` makes a course from what a user names: a session, an MJCF or the built-in robot, a task and its options.
The functions `checked_…` check what a caller gives to an environment: actions, targets and seeds.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from swimgym.swimmers import Fish, Swimmers, load_fish, turned

SEEN = ("crank_cos", "crank_sin", "crank_speed", "roll_rate", "pitch_rate", "yaw_rate")
AHEAD = ("distance", "target_x", "target_y", "target_x_rate", "target_y_rate", "last_action")

MOST_ASIDE = 0.95

GAINS = ("bearing", "bearing_sign", "yaw_rate", "crank_cos", "crank_sin", "drift")
_SIGN_RAD = 0.1  # width of the soft sign of the bearing


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


TASKS: dict[str, Any] = {"target": Targets, "circle": Circle}


def make_course(
    task: str,
    count: int,
    *,
    session: str | Path | None = None,
    mjcf: str | Path | None = None,
    fish: Fish | None = None,
    rules: Rules | None = None,
    workers: int = 0,
    **options: Any,
) -> Course:
    """Make a course of n swimmers with a task, "target" or "circle".

    Args:
        task: name of the task.
        count: n.
        session: folder of a session with a fit, see `load_fish`; without session and MJCF: the built-in robot.
        mjcf: instead, an MJCF, see `load_fish`.
        fish: instead of these, one that was loaded.
        rules: rules of action, reward and episode; default: the paper's, see `swimgym.course`.
        workers: threads; 0 for all cores.
        options: options of the task, see `Targets` and `Circle`; fields of `Rules` change these.

    Raises:
        InputError, ModelMismatch: see `load_fish`.
        TypeError: an option that neither the task nor the rules have.
    """
    own = {each.name: options.pop(each.name) for each in fields(Rules) if each.name in options}
    rules = replace(rules or Rules(), **own)
    fish = fish or load_fish(session, mjcf=mjcf)
    swimmers = Swimmers(fish.models, count, interval_s=rules.interval_s, workers=workers)
    return Course(swimmers, TASKS[task](count, **options), rules)


# A beat of the tail.


def beat_action(rules: Rules, seen: np.ndarray, hz: np.ndarray, aside: np.ndarray) -> np.ndarray:
    """Compute the (n,) accelerations in [-1, 1] that keep up a beat.

    Args:
        rules: rules of the course.
        seen: (n, o) observations, of which those of the crank are used.
        hz: (n,) turns of the crank a second, in the mean over its angle.
        aside: (n,) how much the beat is to the left, from -1 to 1.
    """
    sine, speed = seen[:, 1], seen[:, 2]
    wanted = 2 * np.pi * np.minimum(hz, rules.fastest_hz) * (1 - MOST_ASIDE * np.clip(aside, -1.0, 1.0) * sine)
    return np.clip((wanted - speed) / (rules.acceleration_rad_s2 * rules.interval_s), -1.0, 1.0)


# Checks of what a caller gives.


def checked_action(action: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Check actions of this shape and return them as one array (n,).

    Raises:
        ValueError: of another shape, or not finite numbers.
    """
    given = _numbers("action", action, "an array of numbers from -1 to 1")
    if given.shape != shape:
        raise ValueError(f"action: found the shape {given.shape}, expected {shape}")
    if not np.isfinite(given).all():
        where = np.argwhere(~np.isfinite(given))[0].tolist()
        raise ValueError(f"action: found {given[tuple(where)]} at {where}, expected finite numbers from -1 to 1")
    return given.reshape(-1)


def checked_target(options: dict[str, Any] | None, task: Task, count: int = 1) -> np.ndarray | None:
    """Check the option "target_m" and return it, m: (2,) or, of several swimmers, (n, 2); None where it is not given.

    Args:
        options: options of a reset.
        task: the task of the environment.
        count: number of swimmers.

    Raises:
        ValueError: another option, another shape, or a task whose target cannot be given.
    """
    options = options or {}
    if strange := sorted(set(options) - {"target_m"}):
        raise ValueError(f"options: found {', '.join(map(repr, strange))}, expected 'target_m' or nothing")
    if options.get("target_m") is None:
        return None
    if not isinstance(task, Targets):
        raise ValueError("options: found 'target_m' on a circle, expected it with the task 'target' only")
    target = _numbers("target_m", options["target_m"], "x and y in m")
    shapes = [(2,)] if count == 1 else [(2,), (count, 2)]
    if target.shape not in shapes or not np.isfinite(target).all():
        found = f"the shape {target.shape}" if target.shape not in shapes else target.tolist()
        raise ValueError(f"target_m: found {found}, expected finite x and y in m, {' or '.join(map(str, shapes))}")
    return target


def checked_seeds(seed: int | Sequence[int | None] | None, count: int) -> Sequence[int | None] | None:
    """Check the seeds of n environments and return them; None where one seed, or none, is for all of them.

    Raises:
        ValueError: another number of seeds.
    """
    if seed is None or isinstance(seed, int | np.integer):
        return None
    seeds = [None if each is None else int(each) for each in seed]
    if len(seeds) != count:
        raise ValueError(
            f"seed: found {len(seeds)} seeds, expected one number, or one for each of {count} environments"
        )
    return seeds


def _numbers(name: str, value: Any, expected: str) -> np.ndarray:
    try:
        return np.asarray(value, float)
    except (TypeError, ValueError):
        raise ValueError(f"{name}: found {value!r}, expected {expected}") from None


# A steering law.


def numbers_of(hinges: int) -> tuple[str, ...]:
    """Name the numbers of a law: frequency (logit of its share of the fastest), turning radius (m), gains."""
    return ("hz_logit", "turning_m", *GAINS, *(f"tail_{i + 1}" for i in range(hinges)))


def start_of(task: str, hinges: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the (p,) numbers at which a search of the law begins, and the (p,) widths of the search about them."""
    names = numbers_of(hinges)
    middle, width = np.zeros(len(names)), np.full(len(names), 0.4)
    middle[:3] = 0.4, (1.0 if task == "target" else 0.5), 6.0
    width[:3] = 0.5, 0.15, 2.0
    return middle, width


def steer(numbers: np.ndarray, rules: Rules, seen: np.ndarray) -> np.ndarray:
    """Compute the (n,) actions of swimmers that steer by laws (p,) or (n, p), given what they see (n, o).

    Args:
        numbers: (p,) or (n, p) numbers of the laws, see `numbers_of`.
        rules: rules of the course.
        seen: (n, o) what the swimmers see.
    """
    numbers = np.broadcast_to(numbers, (len(seen), numbers.shape[-1]))
    hinges = numbers.shape[1] - 2 - len(GAINS)
    vector = seen[:, -5:-3]
    bearing = np.arctan2(-vector[:, 1], -vector[:, 0])  # positive to the left
    side = np.sign(bearing)
    told = np.stack(
        [
            bearing,
            np.tanh(bearing / _SIGN_RAD),
            seen[:, 5],
            seen[:, 0],
            seen[:, 1],
            seen[:, -2],
            *seen[:, 6 : 6 + hinges].T,
        ],
        axis=1,
    )
    aside = np.tanh((numbers[:, 2:] * told).sum(axis=1))
    turning = np.abs(numbers[:, 1])
    within = np.hypot(vector[:, 0], vector[:, 1] + side * turning) < turning
    hz = rules.fastest_hz / (1 + np.exp(-numbers[:, 0]))
    return beat_action(rules, seen, hz, np.where(within, -side, aside))
