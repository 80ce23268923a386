"""Training without torch: the numbers of a steering law by the cross-entropy method on the batched twin.

Rubinstein, Methodol. Comput. Appl. Probab. 1 (1999). Every candidate of a generation swims the same episodes, all of
them in one batch; the next generation is drawn about the best.
"""

import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from swimcal.errors import Fault, InputError
from swimcal.results import write_whole
from swimgym.course import Rules, start_of, steer
from swimgym.environments import make_course
from swimgym.policy import Card, Policy, Swum, card_of, swim
from swimgym.swimmers import Fish

Progress = Callable[[str, float | None], None]
_ELITE = 0.2  # share of the candidates about which the next generation is drawn
_LEAST_WIDTH = 0.02  # smallest standard deviation of a generation
_LARGEST_WEIGHT = 0.3  # weight of the largest distance from the path, relative to the mean


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
    state = _resume(state_file, plan, card) or _State(0, *start_of(task, hinges), 0.0, np.inf)
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
        _keep(state_file, state, plan, card)
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


def _keep(file: Path | None, state: _State, plan: SearchPlan, card: Card) -> None:
    if file is not None:
        plain = {"plan": asdict(plan), "model_sha256": card.model_sha256, "task": card.task}
        numbers = {"generation": state.generation, "seconds": state.seconds, "cost": state.cost}
        arrays = {"middle": state.middle.tolist(), "width": state.width.tolist()}
        write_whole(file, json.dumps({**plain, **numbers, **arrays}) + "\n")


def _resume(file: Path | None, plan: SearchPlan, card: Card) -> _State | None:
    """Read the state of the same search; None where there is none, or that of another search, which is overwritten."""
    if file is None or not file.is_file():
        return None
    try:
        data = json.loads(file.read_bytes())
        if (data["plan"], data["model_sha256"], data["task"]) != (asdict(plan), card.model_sha256, card.task):
            return None
        return _State(
            data["generation"], np.array(data["middle"]), np.array(data["width"]), data["seconds"], data["cost"]
        )
    except (ValueError, KeyError, TypeError) as error:
        step = "Remove it; the search then begins anew."
        raise InputError([Fault(str(file), "", "not the state of a search", str(error), "JSON", (), step)]) from error
