"""Makes the trials that diagnoses recommend, each in the world of its session, and has these diagnosed once more."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.effects.answer import Answer
from benchmarks.effects.diagnosing import attempt
from benchmarks.effects.drawn import DrawnTrial, one_more
from benchmarks.effects.each_session import each_session
from benchmarks.effects.filming import film_together
from benchmarks.effects.folder import DIAGNOSIS, Failure, SuiteFolder, Tell
from benchmarks.effects.followed import Confused, confused
from benchmarks.effects.program import Program
from benchmarks.effects.run import clear_away, making_of
from benchmarks.effects.suite import SessionPlan, recorded_by
from benchmarks.effects.told import read_told
from session import SwimcalError, load_session


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
    todo = [each for each in wanted(suite).values() if not was_followed(suite, each)]
    return each_session(partial(_followed, suite, program), todo, workers, scheduler, tell)


def wanted(suite: SuiteFolder) -> Mapping[str, Wanted]:
    """What is to be made, by the names of sessions.

    Raises:
        InputError: a diagnosis is missing or not by the contract, or an answer has another checksum.
    """
    suite.check_diagnosed()
    found = {}
    for answer in suite.true():
        left = confused(answer, read_told(suite.sessions / answer.session / DIAGNOSIS))
        if left is not None:
            found[answer.session] = Wanted(answer, left)
    return found


def was_followed(suite: SuiteFolder, each: Wanted) -> bool:
    """Whether a session was diagnosed with just the trial that its diagnosis wants."""
    folder = suite.followed / each.answer.session
    return (folder / DIAGNOSIS).exists() and _has(folder, each)


def _has(folder: Path, each: Wanted) -> bool:
    """Whether a session holds that trial: one of its own, with a log where that is wanted."""
    if not (folder / "session.toml").exists():
        return False
    more, trial = _more(each), load_session(folder).trials[-1]
    return trial.name == more.name and (trial.motor is not None or not more.logged)


def _more(each: Wanted) -> DrawnTrial:
    trial = each.confused.trial
    return one_more(_plan(each.answer), trial.kind, trial.commanded_hz, trial.logged)


def _followed(suite: SuiteFolder, program: Program, each: Wanted) -> Failure | None:
    answer, folder = each.answer, suite.followed / each.answer.session
    if not answer.strengths:
        return Failure(answer.session, "its answer does not say how it was made: make the suite anew")
    if not _has(folder, each):
        clear_away(suite.followed, answer.session)  # broken off, or made for a diagnosis that wanted another trial
        work = making_of(suite).make_with(_plan(answer), answer.strengths, _more(each), suite.followed)
        try:
            film_together([work])
        except (SwimcalError, ValueError, ArithmeticError) as error:
            return Failure(answer.session, f"{type(error).__name__}: {error}")
    return attempt(program, suite.followed, suite.discrepancy, (answer.session, frozenset()))


def _plan(answer: Answer) -> SessionPlan:
    """As it was planned, but for the detectability: the strengths are known."""
    recorded = recorded_by(np.random.default_rng([answer.seed, 1]))
    present = answer.effects if answer.outside is None else (answer.outside,)
    return SessionPlan(answer.session, answer.seed, recorded, answer.kind, present)
