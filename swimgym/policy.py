"""A policy: a steering law or a small network on disk, its evaluation, and the search for a law.

A `Policy` is a file of plain arrays (npz) with a `PolicyCard` (json). It needs neither torch nor gymnasium.

`swim` lets a controller swim one episode of a course for every swimmer; `Swum` holds the scores: targets reached, with
an interval (`share`), and distances from a path.

`search` finds the numbers of a steering law by the cross-entropy method on the batched twin (Rubinstein, Methodol.
Comput. Appl. Probab. 1, 1999). Every candidate of a generation swims the same episodes, all of them in one batch; the
next generation is drawn about the best.
"""

import json
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, cast

import numpy as np
from scipy.stats import binomtest

from swimcal.errors import Fault, InputError, ModelMismatch
from swimcal.results import from_plain, is_incomplete, plain_json, program_version, to_plain, write_whole, writing_whole
from swimcal.runs import ENGINE
from swimgym.course import Course, Rules, Targets, beat_action, make_course, start_of, steer
from swimgym.swimmers import Fish

SCHEMA = 1
SHIPPED = Path(__file__).parent / "policies"
"""Policies `target` and `circle` that were trained on `datasets/sample`, fitted at quick effort."""

FARTHEST_M = 50.0
_DRAWN = 48  # episodes whose paths are kept
_EVERY = 5  # actions from one point of a kept path to the next
_ELITE = 0.2  # share of the candidates about which the next generation is drawn
_LEAST_WIDTH = 0.02  # smallest standard deviation of a generation
_LARGEST_WEIGHT = 0.3  # weight of the largest distance from the path, relative to the mean
Progress = Callable[[str, float | None], None]
Controller = Callable[[np.ndarray], np.ndarray]
"""A function from what n swimmers see (n, o) to what they do (n,)."""


@dataclass(frozen=True)
class PolicyCard:
    """The origin of a policy.

    Attributes:
        task: "target" or "circle".
        method: "search" or "sac".
        robot, origin, model_sha256: of the fish that it was trained on.
        observations: names of what it sees, in order.
        rules: rules that it was trained under.
        training: how it was trained: seconds, steps, last cost.
        scores: scores of its evaluation; empty before.
        mujoco, program, schema: versions.
    """

    task: str
    method: str
    robot: str
    origin: str
    model_sha256: str
    observations: tuple[str, ...]
    rules: Rules
    seed: int
    training: Mapping[str, Any] = field(default_factory=dict)
    scores: Mapping[str, Any] = field(default_factory=dict)
    mujoco: str = ENGINE
    program: str = field(default_factory=program_version)
    schema: int = SCHEMA


def card_of(task: str, method: str, fish: Fish, course: Course, seed: int) -> PolicyCard:
    """Make the card of a policy that is trained on this fish."""
    return PolicyCard(task, method, fish.robot, fish.origin, fish.sha256, course.names, course.rules, seed)


@dataclass(frozen=True, eq=False)
class Policy:
    """A function from what swimmers see to what they do.

    Its arrays are "law" (p,) of a steering law; or "weight_0", "bias_0", … of a network from `features` to frequency
    and side of the beat.
    """

    card: PolicyCard
    arrays: Mapping[str, np.ndarray]

    def act(self, seen: np.ndarray) -> np.ndarray:
        """Compute the (n,) accelerations in [-1, 1], given what n swimmers see (n, o)."""
        rules = self.card.rules
        if "law" in self.arrays:
            return steer(self.arrays["law"], rules, seen)
        beat = np.tanh(self._through(features(seen)))
        return beat_action(rules, seen, rules.fastest_hz * (1 + beat[:, 0]) / 2, beat[:, 1])

    def _through(self, values: np.ndarray) -> np.ndarray:
        layers = sum(name.startswith("weight_") for name in self.arrays)
        for layer in range(layers):
            values = values @ self.arrays[f"weight_{layer}"].T + self.arrays[f"bias_{layer}"]
            values = np.maximum(values, 0.0) if layer < layers - 1 else values
        return values

    def save(self, file: Path) -> None:
        """Write FILE.npz and its card FILE.json.

        Raises:
            ResultsNotWritable: one of them cannot be written.
        """
        with writing_whole(file.with_suffix(".npz")) as part:
            np.savez_compressed(part, allow_pickle=False, **self.arrays)
        write_whole(file.with_suffix(".json"), json.dumps(plain_json(asdict(self.card)), indent=1) + "\n")

    def scored(self, scores: Mapping[str, Any]) -> "Policy":
        """Return the same policy with scores on its card."""
        return replace(self, card=replace(self.card, scores=scores))

    def check(self, fish: Fish, course: Course, file: str = "the policy") -> None:
        """Refuse a policy for another engine, another robot or other rules of action.

        Raises:
            ModelMismatch: it was trained with another.
        """
        pairs = {
            "MuJoCo": (self.card.mujoco, ENGINE),
            "robot": (self.card.robot, fish.robot),
            "observations": (len(self.card.observations), len(course.names)),
            "interval between actions, s": (self.card.rules.interval_s, course.rules.interval_s),
            "acceleration, rad/s^2": (self.card.rules.acceleration_rad_s2, course.rules.acceleration_rad_s2),
        }
        differ = [f"{what}: trained with {then}, here {now}" for what, (then, now) in pairs.items() if then != now]
        if differ:
            raise ModelMismatch(
                f"{file}: a policy of another robot or engine ({'; '.join(differ)}). What it would do here means "
                "nothing. Train one with `calib policy train`."
            )


def features(seen: np.ndarray) -> np.ndarray:
    """Compute the (n, o + 2) inputs of a network from observations (n, o).

    They are the observations scaled to numbers about 1, and the direction of the target.
    """
    hinges = (seen.shape[1] - 12) // 2
    scale = np.concatenate([[1, 1, 30, 1, 1, 1], np.full(hinges, 0.5), np.full(hinges, 15), [2, 2, 2, 0.5, 0.5, 1]])
    towards = seen[:, -5:-3] / (np.linalg.norm(seen[:, -5:-3], axis=1, keepdims=True) + 0.02)
    return np.hstack([seen / scale, towards]).astype(np.float32)


def load_policy(file: Path) -> Policy:
    """Read what `Policy.save` wrote.

    Raises:
        InputError: it is not there, incomplete, or no policy of this version.
    """
    step = "Train one with `calib policy train`."
    for part in (file.with_suffix(".json"), file.with_suffix(".npz")):
        if is_incomplete(part):
            found, expected = f"{part.name}, whose end is missing or damaged", "the whole file as it was written"
            raise InputError([Fault(str(file), "", "it is incomplete", found, expected, (), step)])
    try:
        data = json.loads(file.with_suffix(".json").read_bytes())
        if data["schema"] != SCHEMA:
            raise ValueError(f"schema {data['schema']}")
        card = PolicyCard(**{**data, "observations": tuple(data["observations"]), "rules": Rules(**data["rules"])})
        with np.load(file.with_suffix(".npz"), allow_pickle=False) as arrays:
            return Policy(card, dict(arrays))
    except FileNotFoundError as error:
        fault = Fault(str(file), "", "there is no such policy", "nothing", "a policy: npz and json", (), step)
        raise InputError([fault]) from error
    except (OSError, ValueError, KeyError, TypeError) as error:
        expected = f"a policy with a card of schema {SCHEMA}"
        raise InputError([Fault(str(file), "", "it cannot be read", str(error), expected, (), step)]) from error


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


# The search for a steering law.


@dataclass(frozen=True)
class SearchPlan:
    """The size of a search: each candidate of each generation swims some episodes, of at most some seconds."""

    generations: int = 15
    candidates: int = 32
    episodes: int = 16
    seconds: float = 50.0
    seed: int = 0


def search(
    fish: Fish,
    task: str,
    plan: SearchPlan | None = None,
    *,
    state_file: Path | None = None,
    workers: int = 0,
    progress: Progress = lambda _message, _share: None,
    **options: Any,
) -> Policy:
    """Search a steering law for a task.

    Args:
        fish: the robot; with several models the candidates' episodes are dealt out to them.
        task: "target" or "circle".
        plan: size of the search.
        state_file: records the state of the search after each generation; a search of the same plan continues from it,
            that of another plan is overwritten.
        workers: threads; 0 for all cores.
        progress: called with a message and the share done.
        options: options of `make_course`.

    Raises:
        InputError: the file cannot be read.
    """
    plan = plan or SearchPlan(episodes=16 if task == "target" else 2)
    course = make_course(
        task, plan.candidates * plan.episodes, fish=fish, workers=workers, **{**options, "seconds": plan.seconds}
    )
    card, hinges = card_of(task, "search", fish, course, plan.seed), len(course.swimmers.hinges)
    searched = {"plan": asdict(plan), "model_sha256": card.model_sha256, "task": card.task}
    state = _resume(state_file, searched) or _State(0, *start_of(task, hinges), 0.0, np.inf)
    while state.generation < plan.generations:
        began, rng = time.monotonic(), np.random.default_rng([plan.seed, state.generation])
        laws = state.middle + state.width * rng.standard_normal((plan.candidates, len(state.middle)))
        laws[0] = state.middle
        each = np.tile(laws, (plan.episodes, 1))  # episode by episode, so that models are dealt out evenly
        goals = 1000 * plan.seed + state.generation
        swum = swim(course, lambda seen, each=each: steer(each, course.rules, seen), goals)  # type: ignore[misc]
        costs = _cost(swum, plan).reshape(plan.episodes, plan.candidates).mean(axis=0)
        best = np.argsort(costs)[: max(2, round(_ELITE * plan.candidates))]
        state = _State(
            state.generation + 1,
            laws[best].mean(axis=0),
            np.maximum(laws[best].std(axis=0), _LEAST_WIDTH),
            state.seconds + time.monotonic() - began,
            float(costs[best[0]]),
        )
        if state_file is not None:
            write_whole(state_file, json.dumps(searched | to_plain(state)) + "\n")
        progress(f"{task}: generation {state.generation}, cost {state.cost:.4f}", state.generation / plan.generations)
    training = {**asdict(plan), "trained_s": state.seconds, "cost": state.cost}
    rules = replace(course.rules, seconds=options.get("seconds", Rules.seconds))
    return Policy(replace(card, training=training, rules=rules), {"law": state.middle})


@dataclass
class _State:
    generation: int
    middle: np.ndarray
    width: np.ndarray
    seconds: float
    cost: float


def _cost(swum: Swum, plan: SearchPlan) -> np.ndarray:
    """Compute the (n,) costs of episodes: off the path where there is one, else how long they took.

    More where they failed.
    """
    failed = ~swum.reached
    mean, largest = swum.off_path_m
    took = np.where(failed, plan.seconds, swum.seconds) / plan.seconds
    return np.where(np.isfinite(mean), mean + _LARGEST_WEIGHT * largest, took) + failed


def _resume(file: Path | None, searched: Mapping[str, Any]) -> _State | None:
    """Read the state of the same search; None where there is none, or that of another search, which is overwritten."""
    if file is None or not file.is_file():
        return None
    try:
        data = json.loads(file.read_bytes())
        if {key: data.pop(key) for key in searched} != searched:
            return None
        return cast(_State, from_plain(_State, data))
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        step = "Remove it; the search then begins anew."
        raise InputError([Fault(str(file), "", "not the state of a search", str(error), "JSON", (), step)]) from error
