"""Maker of the sessions of a suite, and of their answers; after an interruption it goes on where it was."""

import os
import shutil
from collections.abc import Sequence
from functools import partial

from threadpoolctl import threadpool_limits

from benchmarks.cases import Failure, Run, run_cases, write_record
from benchmarks.effects.filming import Filming, film_together
from benchmarks.effects.folder import SuiteFolder
from benchmarks.effects.making import GENERATORS, Generator, Making
from benchmarks.effects.suite import WHOLE, SessionPlan, SuiteSize
from diagnosis.discrepancy import discrepancy_for
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.effects.catalogue import catalogue
from swimcal.errors import Fault, InputError, SwimcalError
from swimcal.robot import load_robot

_TOGETHER = 32  # This many sessions are under way at a time, and as many are lost when a worker dies.
# A piece of work has at most this many times as many sessions: its last ones are made with ever less company.
_ROUNDS_PER_PIECE = 2


def make_suite(suite: SuiteFolder, seed: int, size: SuiteSize, run: Run, shard: slice = WHOLE) -> tuple[Failure, ...]:
    """Make the sessions that are missing; after an interruption go on from there.

    Args:
        suite: the folder to fill.
        seed: seed of the suite.
        size: size of the suite.
        run: way to work off the pieces.
        shard: the sessions to make; others of the same suite may be there already.

    Returns:
        What could not be made; the next run tries it again.

    Raises:
        InputError: the folder holds another suite.
    """
    plans = GENERATORS[size.generator].plan(seed, size)
    _check_same(suite, plans)
    todo = [plan for plan in plans[shard] if not suite.made(plan.name)]
    failures: list[Failure] = []
    batches = {batch[0].name: batch for batch in _split_batches(todo, run.workers)}
    lost = run_cases(partial(_make_together, suite, size.generator), batches, run, failures.extend)
    return (*failures, *lost)


def _split_batches(plans: Sequence[SessionPlan], workers: int) -> list[tuple[SessionPlan, ...]]:
    """Split sessions into pieces for one worker, in order: large enough to save time, equally many for each worker."""
    workers = workers or os.cpu_count() or 1
    rounds = max(-(-len(plans) // (workers * _ROUNDS_PER_PIECE * _TOGETHER)), 1)
    each = max(-(-len(plans) // (rounds * workers)), 1)
    return [tuple(plans[first : first + each]) for first in range(0, len(plans), each)]


@threadpool_limits.wrap(limits=1, user_api="blas")  # small matrices, for which threads only wait
def _make_together(suite: SuiteFolder, by: str, plans: tuple[SessionPlan, ...]) -> list[Failure]:
    generator = GENERATORS[by]
    works = (_make(suite, generator, plan) for plan in plans)
    outcomes = film_together(works, _TOGETHER, generator.simulate)
    return [outcome for outcome in outcomes if outcome is not None]


def _make(suite: SuiteFolder, generator: Generator, plan: SessionPlan) -> Filming[Failure | None]:
    for broken_off in (suite.sessions / plan.name, *suite.sessions.glob(f".{plan.name}.*")):
        shutil.rmtree(broken_off, ignore_errors=True)
    making = Making(generator, discrepancy_for(FISHSIM_MARKERS, load_robot()), catalogue())
    try:
        answer = yield from making.make(plan, suite.sessions)
    except (SwimcalError, ValueError, ArithmeticError) as error:
        return Failure(plan.name, f"{type(error).__name__}: {error}")
    write_record(suite.answer(plan.name), answer)
    return None


def _check_same(suite: SuiteFolder, plans: Sequence[SessionPlan]) -> None:
    there = {path.name for path in suite.sessions.glob("[!.]*") if path.is_dir()}  # not what broke off
    strange = there - {plan.name for plan in plans}
    if strange:
        fault = Fault(
            str(suite.sessions),
            "",
            "the folder holds sessions of another suite",
            ", ".join(sorted(strange)[:3]),
            "an empty folder, or sessions of the same seed and size",
            next_step="Give another folder, or the seed and size it was made with.",
        )
        raise InputError([fault])
