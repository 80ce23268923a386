"""Makes the trials that diagnoses recommend, each in the world of its session, and has these diagnosed once more."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.cases import Failure, Run, run_cases
from benchmarks.effects.diagnosing import Program, diagnose_one
from benchmarks.effects.drawn import DrawnTrial, one_more
from benchmarks.effects.filming import film_together
from benchmarks.effects.folder import DIAGNOSIS, Answer, SuiteFolder
from benchmarks.effects.making import clear_away, making_of
from benchmarks.effects.suite import SessionPlan, recorded_by
from benchmarks.effects.told import Told, Trial, read_told
from session import load_session


class Wanted(NamedTuple):
    """An effect that is there and told as one of several, and the trial that is to tell it from them."""

    answer: Answer  # of the session
    effect: str  # its name
    # the first that was recommended of those that can be made, whichever two of the group it is to separate: nobody who
    # follows it knows which of them is there
    trial: Trial

    @property
    def plan(self) -> SessionPlan:
        """The session as it was planned, but for the detectability: the strengths are known."""
        answer = self.answer
        recorded = recorded_by(np.random.default_rng([answer.seed, 1]))
        present = answer.effects if answer.outside is None else (answer.outside,)
        return SessionPlan(answer.session, answer.seed, recorded, answer.kind, present)

    @property
    def more(self) -> DrawnTrial:
        """The trial as it is to be made."""
        return one_more(self.plan, self.trial.kind, self.trial.commanded_hz, self.trial.logged)

    def in_session(self, folder: Path) -> bool:
        """Whether a session holds that trial: one of its own, with a log where that is wanted."""
        if not (folder / "session.toml").exists():
            return False
        more, trial = self.more, load_session(folder).trials[-1]
        return trial.name == more.name and (trial.motor is not None or not more.logged)


def follow_suite(suite: SuiteFolder, program: Program, run: Run) -> tuple[Failure, ...]:
    """Diagnoses sessions with the trial that their diagnosis recommends, in `F/followed`.

    This opens the answers, of sessions that are diagnosed: those are followed in which an effect that is there is told
    as one of several. The program is told nothing but the session with its new trial.

    Args, Returns, Raises: as of `diagnose_suite`; all sessions must be diagnosed.
    """
    todo = {name: each for name, each in wanted(suite).items() if not was_followed(suite, each)}
    return run_cases(partial(_followed, suite, program), todo, run)


def wanted(suite: SuiteFolder) -> Mapping[str, Wanted]:
    """What is to be made, by the names of sessions.

    Raises:
        InputError: a diagnosis is missing or not by the contract.
    """
    suite.check_diagnosed()
    of_each = ((answer, read_told(suite.sessions / answer.session / DIAGNOSIS)) for answer in suite.true())
    return {answer.session: each for answer, told in of_each if (each := confused(answer, told)) is not None}


def confused(answer: Answer, told: Told) -> Wanted | None:
    """What a diagnosis leaves confused, and what it wants to see for it; None where there is no such thing."""
    for group in told.said:
        present = [name for name in group if answer.present(name)]
        wanted = [each.trial for each in told.next_experiments or () if set(each.separates) <= set(group)]
        trials = [trial for trial in wanted if trial is not None]
        if len(group) > 1 and present and trials:
            return Wanted(answer, present[0], trials[0])
    return None


def was_followed(suite: SuiteFolder, each: Wanted) -> bool:
    """Whether a session was diagnosed with just the trial that its diagnosis wants."""
    folder = suite.followed / each.answer.session
    return (folder / DIAGNOSIS).exists() and each.in_session(folder)


def _followed(suite: SuiteFolder, program: Program, each: Wanted) -> None:
    answer, folder = each.answer, suite.followed / each.answer.session
    if not answer.strengths:
        raise ValueError("its answer does not say how it was made: make the suite anew")
    if not each.in_session(folder):
        clear_away(suite.followed, answer.session)  # broken off, or made for a diagnosis that wanted another trial
        film_together([making_of(suite).make_with(each.plan, answer.strengths, each.more, suite.followed)])
    diagnose_one(program, suite.discrepancy, (folder, frozenset()))
