"""Makes the trials that diagnoses recommend, each in the world of its session, and has these diagnosed once more."""

import shutil
from collections.abc import Mapping
from functools import partial
from typing import NamedTuple

import numpy as np

from calib.benchmarks.effects.answer import Answer
from calib.benchmarks.effects.diagnosing import attempt
from calib.benchmarks.effects.drawn import one_more
from calib.benchmarks.effects.each_session import each_session
from calib.benchmarks.effects.filming import film_together
from calib.benchmarks.effects.folder import DIAGNOSIS, Failure, SuiteFolder, Tell
from calib.benchmarks.effects.followed import Confused, confused
from calib.benchmarks.effects.making import Making
from calib.benchmarks.effects.program import Program
from calib.benchmarks.effects.suite import SessionPlan, recorded_by
from calib.benchmarks.effects.told import read_told
from diagnosis import Discrepancy
from reality.mechanisms import catalogued, uncatalogued
from session import SwimcalError
from swimmer.effects import catalogue


class Wanted(NamedTuple):
    """A session, and what its diagnosis leaves confused."""

    answer: Answer
    confused: Confused


def follow_suite(
    suite: SuiteFolder,
    program: Program,
    workers: int = 0,
    scheduler: str | None = None,
    tell: Tell | None = None,
) -> tuple[Failure, ...]:
    """Diagnoses sessions with the trial that their diagnosis recommends, in `F/followed`.

    This opens the answers, of sessions that are diagnosed: those are followed in which an effect that is there is told
    as one of several. The program is told nothing but the session with its new trial.

    Args, Returns, Raises: as of `diagnose_suite`; all sessions must be diagnosed.
    """
    todo = [each for name, each in wanted(suite).items() if not (suite.followed / name / DIAGNOSIS).exists()]
    return each_session(partial(_followed, suite, program), todo, workers, scheduler, tell)


def wanted(suite: SuiteFolder) -> Mapping[str, Wanted]:
    """What is to be made, by the names of sessions.

    Raises:
        InputError: a diagnosis is missing or not by the contract, or an answer has another checksum.
    """
    found = {}
    for answer in suite.unsealed():
        left = confused(answer, read_told(suite.sessions / answer.session / DIAGNOSIS))
        if left is not None:
            found[answer.session] = Wanted(answer, left)
    return found


def _followed(suite: SuiteFolder, program: Program, each: Wanted) -> Failure | None:
    answer, trial = each.answer, each.confused.trial
    if not answer.strengths:
        return Failure(answer.session, "its answer does not say how it was made: make the suite anew")
    if not (suite.followed / answer.session / "session.toml").exists():
        plan = _plan(answer)
        more = one_more(plan, "dry" if trial.kind == "dry" else "swim", trial.commanded_hz, trial.logged)
        making = Making({**catalogued(), **uncatalogued()}, Discrepancy.load(suite.discrepancy), catalogue())
        for broken_off in suite.followed.glob(f".{answer.session}.*"):
            shutil.rmtree(broken_off, ignore_errors=True)
        try:
            film_together([making.make_with(plan, answer.strengths, more, suite.followed)])
        except (SwimcalError, ValueError, ArithmeticError) as error:
            return Failure(answer.session, f"{type(error).__name__}: {error}")
    return attempt(program, suite.followed, suite.discrepancy, (answer.session, frozenset()))


def _plan(answer: Answer) -> SessionPlan:
    """As it was planned, but for the detectability: the strengths are known."""
    recorded = recorded_by(np.random.default_rng([answer.seed, 1]))
    present = answer.effects if answer.outside is None else (answer.outside,)
    return SessionPlan(answer.session, answer.seed, recorded, answer.kind, present)
