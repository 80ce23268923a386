"""Makes the sessions of a suite, and their answers; broken off, it goes on where it was."""

import json
import shutil
from collections.abc import Sequence
from functools import partial

from calib.benchmarks.effects.answer import checksum, seal
from calib.benchmarks.effects.discrepancy import load_discrepancy
from calib.benchmarks.effects.each_session import each_session
from calib.benchmarks.effects.folder import Failure, SuiteFolder, Tell
from calib.benchmarks.effects.making import Making, undated
from calib.benchmarks.effects.suite import SessionPlan, SuiteSize, plan_suite
from reality.mechanisms import catalogued, uncatalogued
from session import FaultCollector, SwimcalError, write_whole
from swimmer.effects import catalogue


def make_suite(
    suite: SuiteFolder,
    seed: int,
    size: SuiteSize,
    workers: int = 0,
    scheduler: str | None = None,
    tell: Tell | None = None,
) -> tuple[Failure, ...]:
    """Makes the sessions that are missing; broken off, it goes on where it was.

    Args:
        suite: where; its discrepancy must be there.
        seed, size: of the suite.
        workers: sessions at a time; 0 for one on each core.
        scheduler: address of a dask scheduler whose workers make them; they need to see the same folder.
        tell: of the progress.

    Returns:
        What could not be made; the next run tries it again.

    Raises:
        InputError: no scheduler answers, or the folder holds another suite.
    """
    plans = plan_suite(seed, size, tuple(catalogued()), tuple(uncatalogued()))
    _check_same(suite, plans)
    todo = [plan for plan in plans if not suite.made(plan.name)]
    failures = each_session(partial(_made, suite), todo, workers, scheduler, tell)
    there = sorted(path.stem for path in suite.answers.glob("*.sealed"))
    sums = {name: checksum(suite.answer(name)) for name in there}
    write_whole(suite.checksums, json.dumps(sums, indent=1) + "\n")
    return failures


def _made(suite: SuiteFolder, plan: SessionPlan) -> Failure | None:
    for broken_off in (suite.sessions / plan.name, *suite.sessions.glob(f".{plan.name}.*")):
        shutil.rmtree(broken_off, ignore_errors=True)
    making = Making({**catalogued(), **uncatalogued()}, load_discrepancy(suite.discrepancy), catalogue())
    try:
        answer = making.make(plan, suite.sessions)
    except (SwimcalError, ValueError, ArithmeticError) as error:
        return Failure(plan.name, f"{type(error).__name__}: {error}")
    suite.answers.mkdir(parents=True, exist_ok=True)
    seal([answer], suite.answer(plan.name))
    undated(suite.answer(plan.name))
    return None


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
