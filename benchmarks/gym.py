"""Speed at which environments are stepped: the batch of this program against one process for each environment."""

import os
from collections.abc import Callable
from functools import partial
from time import perf_counter
from typing import Any

import gymnasium
import numpy as np

_NAME = "swimgym:swimgym/Target-v0"
_SECONDS = 2.0  # Each rate is measured for this long.
_ROUNDS = 3
RATIO = "best batch over best processes"


def measure_gym(**options: Any) -> dict[str, float]:
    """Measure steps a second of one environment of each kind, median of rounds by turns, and the ratio of the best.

    Args:
        options: options of the environments, for instance `session`.
    """
    cores = os.cpu_count() or 1
    single, many = partial(gymnasium.make, _NAME, **options), partial(gymnasium.make_vec, _NAME, **options)
    kinds: dict[str, Callable[[], Any]] = {"one environment": single}
    kinds |= {f"{n} processes": partial(many, n, "async") for n in (cores, 4 * cores)}
    kinds |= {f"batch of {n}": partial(many, n, "vector_entry_point") for n in (64, 256, 1024)}
    kinds["batch of 256, one thread"] = partial(many, 256, "vector_entry_point", workers=1)
    rounds = [{kind: _measure_rate(make()) for kind, make in kinds.items()} for _ in range(_ROUNDS)]
    found = {kind: float(np.median([each[kind] for each in rounds])) for kind in kinds}
    batch, processes = (max(found[kind] for kind in kinds if what in kind) for what in ("batch", "processes"))
    return found | {RATIO: batch / processes}


def _measure_rate(env: Any) -> float:
    env.reset(seed=0)
    env.action_space.seed(0)
    actions, done = [env.action_space.sample() for _ in range(16)], 0
    env.step(actions[0])
    began = perf_counter()
    while perf_counter() - began < _SECONDS:
        env.step(actions[done % len(actions)])
        done += 1
    rate = done * getattr(env, "num_envs", 1) / (perf_counter() - began)
    env.close()
    return rate
