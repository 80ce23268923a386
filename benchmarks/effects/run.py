"""Makes the sessions of a suite, and their answers; broken off, it goes on where it was."""

import os
import shutil
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from threadpoolctl import threadpool_limits

from benchmarks.effects.filming import Filming, film_together
from benchmarks.effects.folder import Failure, SuiteFolder, Tell
from benchmarks.effects.making import Making
from benchmarks.effects.suite import WHOLE, SessionPlan, Shard, SuiteSize, plan_suite
from benchmarks.reality.mechanisms import catalogued, uncatalogued
from benchmarks.spread import spread
from diagnosis import Discrepancy, shipped_discrepancy
from session import FaultCollector, SwimcalError, write_whole
from swimmer.effects import catalogue

_TOGETHER = 32  # sessions under way at a time: as many are lost when a worker dies
_PIECES = 2  # as many sessions as that a piece of work has: the last of them are made with ever less company


def make_suite(
    suite: SuiteFolder,
    seed: int,
    size: SuiteSize,
    workers: int = 0,
    scheduler: str | None = None,
    tell: Tell | None = None,
    shard: Shard = WHOLE,
) -> tuple[Failure, ...]:
    """Makes the sessions that are missing; broken off, it goes on where it was.

    Args:
        suite: where; without a discrepancy of its own it gets the one that is shipped.
        seed, size: of the suite.
        workers: sessions at a time; 0 for one on each core.
        scheduler: address of a dask scheduler whose workers make them; they need to see the same folder.
        tell: of the progress.
        shard: which of its sessions; others of the same suite may be there already.

    Returns:
        What could not be made; the next run tries it again.

    Raises:
        InputError: no scheduler answers, or the folder holds another suite.
    """
    plans = plan_suite(seed, size, tuple(catalogued()), tuple(uncatalogued()))
    _check_same(suite, plans)
    if not suite.discrepancy.exists():
        write_whole(suite.discrepancy, shipped_discrepancy().read_bytes())
    todo = [plan for plan in shard.of(plans) if not suite.made(plan.name)]
    failures: list[Failure] = []
    done = 0
    for made, failed in spread(partial(_made_together, suite), _batches(todo, workers), workers, scheduler):
        failures += failed
        done += made
        if tell is not None:
            tell(f"{done} of {len(todo)} sessions", done / len(todo))
    return tuple(failures)


def _batches(plans: Sequence[SessionPlan], workers: int) -> list[tuple[SessionPlan, ...]]:
    """Sessions that one worker makes, in their order: as many as save time, and every worker as many pieces."""
    workers = workers or os.cpu_count() or 1
    rounds = max(-(-len(plans) // (workers * _PIECES * _TOGETHER)), 1)
    each = max(-(-len(plans) // (rounds * workers)), 1)
    return [tuple(plans[first : first + each]) for first in range(0, len(plans), each)]


@threadpool_limits.wrap(limits=1, user_api="blas")  # small matrices, for which threads only wait
def _made_together(suite: SuiteFolder, plans: tuple[SessionPlan, ...]) -> tuple[int, list[Failure]]:
    """How many were tried, and what failed."""
    outcomes = film_together((_made(suite, plan) for plan in plans), _TOGETHER)
    return len(plans), [outcome for outcome in outcomes if outcome is not None]


def _made(suite: SuiteFolder, plan: SessionPlan) -> Filming[Failure | None]:
    if suite.made(plan.name):  # a cluster does again what a worker had done that then died
        return None
    clear_away(suite.sessions, plan.name)
    try:
        answer = yield from making_of(suite).make(plan, suite.sessions)
    except (SwimcalError, ValueError, ArithmeticError) as error:
        return Failure(plan.name, f"{type(error).__name__}: {error}")
    answer.write(suite.answer(plan.name))
    return None


def making_of(suite: SuiteFolder) -> Making:
    """All that reality can do, beside the discrepancy of a suite."""
    return Making({**catalogued(), **uncatalogued()}, Discrepancy.load(suite.discrepancy), catalogue())


def clear_away(folder: Path, name: str) -> None:
    """Removes a session from a folder of sessions, whole or broken off."""
    for there in (folder / name, *folder.glob(f".{name}.*")):
        shutil.rmtree(there, ignore_errors=True)


def _check_same(suite: SuiteFolder, plans: Sequence[SessionPlan]) -> None:
    there = {path.name for path in suite.sessions.glob("[!.]*") if path.is_dir()}  # not what broke off
    strange = there - {plan.name for plan in plans}
    faults = FaultCollector(str(suite.sessions))
    if strange:
        faults.add(
            "",
            "the folder holds sessions of another suite",
            found=", ".join(sorted(strange)[:3]),
            expected="an empty folder, or sessions of the same seed and size",
            next_step="Give another folder, or the seed and size it was made with.",
        )
    faults.raise_if_any()
