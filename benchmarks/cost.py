"""Where the time of a command goes: simulated seconds, CPU time within the engine, and CPU time elsewhere."""

import shutil
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np
from mujoco.batch import Batch

import calib
from benchmarks.scores import Table
from calib.benchmark import FITTED
from swimmer import Runs, Twin, load_robot

COMMANDS = ("fit", "diagnose", "posterior", "report")
REFERENCE_S = 10_000.0
"""Simulated seconds of the fitted twin, in whose CPU time costs are told."""


class Cost(NamedTuple):
    """Of one command."""

    command: str  # its name
    simulated_s: float  # of all twins
    engine_s: float  # CPU seconds within the engine, on all cores
    elsewhere_s: float  # other CPU seconds


def measure_costs(folder: Path, commands: tuple[str, ...] = COMMANDS) -> tuple[tuple[Cost, ...], float]:
    """Runs commands one after the other on a copy of a session without its results; and the reference, CPU seconds."""
    with TemporaryDirectory() as place:
        copy = shutil.copytree(folder, Path(place) / folder.name, ignore=shutil.ignore_patterns("results"))
        session = calib.open_session(copy)
        costs = tuple(_cost(name, lambda name=name: getattr(calib, name)(session)) for name in commands)  # type: ignore[misc]
    twin, values = Twin(load_robot(), workers=1), np.tile(FITTED, (20, 1))
    runs = Runs(values, np.linspace(0.5, 1.75, 20), np.ones(20))
    began = time.process_time()
    twin.simulate(runs, np.arange(0.0, REFERENCE_S / 200, 1 / 60))
    return costs, 10 * (time.process_time() - began)


def _cost(command: str, call: Callable[[], Any]) -> Cost:
    spent = {"simulated": 0.0, "engine": 0.0}

    def counted(name: str) -> Any:
        plain = getattr(Batch, name)

        def call_engine(batch: Batch, *args: Any, **more: Any) -> Any:
            ids, began = more.get("ids"), time.process_time()
            answer = plain(batch, *args, **more)
            spent["engine"] += time.process_time() - began
            steps = args[0] if name == "rollout" else more.get("nstep", 1)
            spent["simulated"] += steps * (batch.nsim if ids is None else len(ids)) * batch.model.opt.timestep
            return answer

        return patch.object(Batch, name, call_engine)

    with ExitStack() as stack:
        for name in ("rollout", "step"):
            stack.enter_context(counted(name))
        began = time.process_time()
        call()
        total = time.process_time() - began
    return Cost(command, spent["simulated"], spent["engine"], total - spent["engine"])


def cost_table(costs: tuple[Cost, ...], reference_s: float) -> Table:
    """For a terminal or a page."""
    rows = []
    for name, simulated_s, engine_s, elsewhere_s in costs:
        whole_s = engine_s + elsewhere_s
        spent = f"{simulated_s:.0f}", f"{engine_s:.1f}", f"{elsewhere_s:.1f}", f"{engine_s / whole_s:.0%}"
        rows.append((name, *spent, f"{whole_s / reference_s:.2f}"))
    head = ("command", "simulated, s", "engine, CPU s", "elsewhere, CPU s", "engine's share", "references")
    return Table(f"A reference, {REFERENCE_S:.0f} s of the twin: {reference_s:.1f} CPU s.", head, tuple(rows))


if __name__ == "__main__":
    import sys

    found = measure_costs(Path(sys.argv[1]), tuple(sys.argv[2:]) or COMMANDS)
    print(cost_table(*found).text())
