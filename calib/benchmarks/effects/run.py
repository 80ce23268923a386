"""A suite as a folder: sessions that anybody may diagnose, answers apart from them, and what came of it."""

import json
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from calib.benchmarks.effects.answer import checksum, seal, unseal
from calib.benchmarks.effects.discrepancy import load_discrepancy
from calib.benchmarks.effects.evidence import evidence_of
from calib.benchmarks.effects.making import Making
from calib.benchmarks.effects.rules import RULES
from calib.benchmarks.effects.score import Score, scored
from calib.benchmarks.effects.suite import SessionPlan, SuiteSize, plan_suite
from calib.benchmarks.effects.told import Told, read_told
from calib.benchmarks.spread import spread
from reality.mechanisms import catalogued, uncatalogued
from session import FaultCollector, InputError, SwimcalError, write_whole
from swimmer.effects import catalogue

Tell = Callable[[str, float | None], None]
DIAGNOSIS = Path("results") / "diagnosis.json"


class Failure(NamedTuple):
    """A session that could not be made, and why."""

    name: str
    message: str


class SuiteFolder(NamedTuple):
    """Where a suite is.

    Attributes:
        folder: of the suite.
    """

    folder: Path

    @property
    def sessions(self) -> Path:
        """A folder a session."""
        return self.folder / "sessions"

    @property
    def answers(self) -> Path:
        """A sealed file a session; nothing but the scorer opens them."""
        return self.folder / "answers"

    @property
    def checksums(self) -> Path:
        """Of the answers, published with the sessions."""
        return self.folder / "checksums.json"

    @property
    def discrepancy(self) -> Path:
        """What every diagnosis may know of reality's base state."""
        return self.folder / "discrepancy.npz"

    def answer(self, name: str) -> Path:
        """The sealed answer of a session."""
        return self.answers / f"{name}.sealed"

    def made(self, name: str) -> bool:
        """Whether a session is there, and its answer."""
        return (self.sessions / name / "session.toml").exists() and self.answer(name).exists()


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
    failures = []
    for number, failure in enumerate(spread(partial(_made, suite), todo, workers, scheduler)):
        if failure is not None:
            failures.append(failure)
        if tell is not None:
            tell(f"{number + 1} of {len(todo)} sessions", (number + 1) / len(todo))
    there = sorted(path.stem for path in suite.answers.glob("*.sealed"))
    sums = {name: checksum(suite.answer(name)) for name in there}
    write_whole(suite.checksums, json.dumps(sums, indent=1) + "\n")
    return tuple(failures)


def score_suite(suite: SuiteFolder, told: Callable[[str], Told] | None = None) -> Score:
    """Scores the diagnoses in the folders of the sessions, of any program.

    Args:
        suite: whose sessions were diagnosed.
        told: of a session by its name; default: its `results/diagnosis.json`.

    Raises:
        InputError: a diagnosis is missing or not by the contract, or an answer has another checksum; all at once.
    """
    told = told or (lambda name: read_told(suite.sessions / name / DIAGNOSIS))
    sums: dict[str, str] = json.loads(suite.checksums.read_text())
    faults, diagnoses = FaultCollector(str(suite.folder)), []
    for name in sums:
        try:
            diagnoses.append(told(name))
        except InputError as error:
            faults.extend_capped(list(error.faults))
    faults.raise_if_any()
    answers = [answer for name, expected in sums.items() for answer in unseal(suite.answer(name), expected)]
    return scored(answers, diagnoses)


def score_rules(
    suite: SuiteFolder, workers: int = 0, scheduler: str | None = None, tell: Tell | None = None
) -> dict[str, Score]:
    """Scores the trivial rules on the sessions as they are.

    Args:
        suite: that was made.
        workers, scheduler: as of `make_suite`.
        tell: of the progress.
    """
    names = sorted(json.loads(suite.checksums.read_text()))
    told: dict[str, dict[str, Told]] = {}
    for number, (name, by_rule) in enumerate(spread(partial(_by_rules, suite), names, workers, scheduler)):
        told[name] = by_rule
        if tell is not None:
            tell(f"{number + 1} of {len(names)} sessions", (number + 1) / len(names))
    return {rule: score_suite(suite, lambda name, rule=rule: told[name][rule]) for rule in RULES}  # type: ignore[misc]


def _by_rules(suite: SuiteFolder, name: str) -> tuple[str, dict[str, Told]]:
    evidence = evidence_of(suite.sessions / name, load_discrepancy(suite.discrepancy), catalogue())
    return name, {rule: judge(evidence, np.random.default_rng(int(name[1:], 16))) for rule, judge in RULES.items()}


def _made(suite: SuiteFolder, plan: SessionPlan) -> Failure | None:
    making = Making({**catalogued(), **uncatalogued()}, load_discrepancy(suite.discrepancy), catalogue())
    try:
        answer = making.make(plan, suite.sessions)
    except (SwimcalError, ValueError, ArithmeticError) as error:
        return Failure(plan.name, f"{type(error).__name__}: {error}")
    suite.answers.mkdir(parents=True, exist_ok=True)
    seal([answer], suite.answer(plan.name))
    return None


def _check_same(suite: SuiteFolder, plans: Sequence[SessionPlan]) -> None:
    there = {path.name for path in suite.sessions.glob("*") if path.is_dir()}
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
