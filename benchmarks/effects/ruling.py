"""Trivial rules over the sessions of a suite; what they said is kept as diagnoses are."""

import json
from functools import partial

import numpy as np

from benchmarks.effects.each_session import each_session
from benchmarks.effects.evidence import evidence_of
from benchmarks.effects.folder import Failure, SuiteFolder, Tell
from benchmarks.effects.rules import RULES
from diagnosis import Discrepancy
from session import SwimcalError, write_whole
from swimmer.effects import catalogue


def judge_suite(
    suite: SuiteFolder, workers: int = 0, scheduler: str | None = None, tell: Tell | None = None
) -> tuple[Failure, ...]:
    """Judges the sessions that no rule has judged yet.

    Args:
        suite: that was made.
        workers: sessions at a time; 0 for one on each core.
        scheduler: address of a dask scheduler whose workers do it; they need to see the same folder.
        tell: of the progress.

    Returns:
        Sessions that cannot be fitted; the next run tries them again.

    Raises:
        InputError: no scheduler answers.
    """
    todo = [name for name in suite.names if not all(suite.rule(rule, name).exists() for rule in RULES)]
    return each_session(partial(_judged, suite), todo, workers, scheduler, tell)


def _judged(suite: SuiteFolder, name: str) -> Failure | None:
    try:
        evidence = evidence_of(suite.sessions / name, Discrepancy.load(suite.discrepancy), catalogue())
    except (SwimcalError, ValueError, ArithmeticError) as error:
        return Failure(name, f"{type(error).__name__}: {error}")
    for rule, judge in RULES.items():
        told = judge(evidence, np.random.default_rng(int(name[1:], 16)))
        write_whole(suite.rule(rule, name), json.dumps(told.to_json(), indent=1) + "\n")
    return None
