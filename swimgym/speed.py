"""How fast environments are stepped: the batch of this program against one process for each environment."""

import os
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import gymnasium
import numpy as np

NAME = "swimgym:swimgym/Target-v0"


@dataclass(frozen=True)
class GymSpeed:
    """Steps of one environment a second, in one run, by turns.

    Attributes:
        cores: of this machine.
        batch: by number of swimmers: of the vector environment.
        threads: by number of threads: of the vector environment with the most swimmers.
        processes: by number of environments: of gymnasium's `AsyncVectorEnv`, a process each.
        single: of one environment in this process.
    """

    cores: int
    batch: dict[int, float]
    threads: dict[int, float]
    processes: dict[int, float]
    single: float

    @property
    def ratio(self) -> float:
        """The best batch over the best of the processes."""
        return max(self.batch.values()) / max(self.processes.values())

    def table(self) -> str:
        """As lines."""
        lines = [f"single environment, 1 process: {self.single:8.0f} steps/s"]
        lines += [f"AsyncVectorEnv, {n:4} processes: {rate:8.0f} steps/s" for n, rate in self.processes.items()]
        lines += [f"batch of {n:5} swimmers:      {rate:8.0f} steps/s" for n, rate in self.batch.items()]
        lines += [f"the same, {n:2} thread(s):       {rate:8.0f} steps/s" for n, rate in self.threads.items()]
        return "\n".join([*lines, f"best batch over best processes: {self.ratio:.1f} times, on {self.cores} cores"])


def measure_gym_speed(options: dict[str, Any] | None = None, seconds: float = 2.0, rounds: int = 3) -> GymSpeed:
    """Measures by turns, so that whatever else the machine does falls on all alike; the median of the rounds counts."""
    options = options or {}
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    batches, most = (64, 256, 1024), 256
    kinds: dict[tuple[str, int], Any] = {("single", 1): lambda: gymnasium.make(NAME, **options)}
    for n in sorted({cores, 4 * cores}):
        kinds["processes", n] = lambda n=n: gymnasium.make_vec(NAME, n, vectorization_mode="async", **options)
    for n in batches:
        kinds["batch", n] = lambda n=n: _batch(n, **options)
    for n in sorted({1, *(2**k for k in range(1, cores.bit_length()) if 2**k <= cores), cores}):
        kinds["threads", n] = lambda n=n: _batch(most, **options, workers=n)
    found: dict[tuple[str, int], list[float]] = {kind: [] for kind in kinds}
    for _ in range(rounds):
        for kind, make in kinds.items():
            found[kind].append(_rate(make(), seconds))
    of = {what: {n: float(np.median(r)) for (w, n), r in found.items() if w == what} for what, _ in kinds}
    return GymSpeed(cores, of["batch"], of["threads"], of["processes"], of["single"][1])


def _batch(n: int, **options: Any) -> gymnasium.vector.VectorEnv:
    return gymnasium.make_vec(NAME, n, vectorization_mode="vector_entry_point", **options)


def _rate(env: Any, seconds: float) -> float:
    env.reset(seed=0)
    env.action_space.seed(0)
    actions, done = [env.action_space.sample() for _ in range(16)], 0
    env.step(actions[0])
    began = perf_counter()
    while perf_counter() - began < seconds:
        env.step(actions[done % len(actions)])
        done += 1
    rate = done * getattr(env, "num_envs", 1) / (perf_counter() - began)
    env.close()
    return rate
