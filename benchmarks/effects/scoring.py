"""Opens the answers of a suite and scores what was said of its sessions."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from benchmarks.cases import read_lines
from benchmarks.effects.folder import DIAGNOSIS, SECONDS, SuiteFolder
from benchmarks.effects.following import wanted, was_followed
from benchmarks.effects.rules import judgements
from benchmarks.effects.score import (
    Case,
    has_stage,
    measures,
    measures_followed,
    measures_together,
    measures_without,
    of_kind,
    reachable,
)
from benchmarks.effects.told import Told, read_told
from benchmarks.scores import Scores, Table
from diagnosis.diagnosis import ALL_AT_ONCE
from session import FaultCollector, InputError

PROGRAM = "diagnosis"
_NOTES = (
    "d: detectability, how far what an effect does lies from what its nearest rival, refitted, can do, in standard "
    "deviations of noise, nuisances and discrepancy.",
    "95 % intervals: of shares by Wilson, of numbers by drawing sessions anew, of chance by drawing what comes true.",
)


@dataclass(frozen=True)
class Outcome:
    """What came of a suite."""

    cases: Mapping[str, Sequence[Case]]  # of the program and of the trivial rules, as far as they were run, by name
    without: Sequence[Case] = ()  # of the program whose catalogue lacked the effect that is there
    # each effect that was one of several, and what was told with the trial that was recommended
    followed: Sequence[tuple[str, Told]] = ()
    missing: int = 0  # sessions that should have been followed and were not

    def scores(self, command: str) -> Scores:
        """All tables.

        Args:
            command: that made them.
        """
        first = next(iter(self.cases.values()))
        kinds = [case.answer.kind for case in first]
        counts = ", ".join(f"{kinds.count(kind)} {kind}" for kind in dict.fromkeys(sorted(kinds)))
        asked = [case for case in self.cases.get(PROGRAM, ()) if case.told.effort in ALL_AT_ONCE]
        caption = f"{len(kinds)} sessions: {counts}"
        tables = [Table.of(caption, {name: measures(own) for name, own in self.cases.items()})]
        if self.without:
            caption = "Without the effect that is there in the catalogue"
            tables.append(Table.of(caption, {PROGRAM: measures_without(self.without)}))
        if self.followed or self.missing:
            caption = "With the trial that was recommended"
            tables.append(Table.of(caption, {PROGRAM: measures_followed(self.followed, self.missing)}))
        if asked:
            tables.append(Table.of("All effects at once", {PROGRAM: measures_together(asked)}))
        tables.append(_reachable(first))
        return Scores(
            title="Withheld effects",
            data="synthetic: sessions of a second simulator, the effect withheld from what diagnoses them",
            command=command,
            tables=tuple(table for table in tables if table.rows),
            notes=_NOTES,
        )


def score_all(suite: SuiteFolder) -> Outcome:
    """Scores whatever stands in the folder of a suite: rules, diagnoses, those without the effect or with a trial more.

    Raises:
        InputError: not every session is diagnosed, or not judged by rules that were run.
    """
    suite.check_diagnosed()
    cases = {PROGRAM: score_suite(suite)}
    if suite.rules.exists():
        cases |= score_rules(suite)
    without = score_without(suite) if suite.without.exists() else ()
    return Outcome(cases, without, *(score_followed(suite) if suite.followed.exists() else ((), 0)))


def score_file(path: Path) -> Outcome:
    """Scores cases in a file, of one shard or of several, one after the other.

    Raises:
        InputError: it holds no cases.
    """
    return Outcome({PROGRAM: read_lines(path, Case, lambda case: case.answer.session)})


def score_suite(suite: SuiteFolder) -> tuple[Case, ...]:
    """The diagnoses in the folders of the sessions, of any program, beside what is true.

    Raises:
        InputError: a diagnosis is missing or not by the contract; all at once.
    """
    told = _all_told(suite, suite.names, lambda name: _told(suite.sessions / name))
    true = suite.true()  # opened last: a diagnosis that is still to come could have seen them
    return tuple(Case(answer, told[answer.session]) for answer in true)


def score_rules(suite: SuiteFolder) -> dict[str, tuple[Case, ...]]:
    """What the trivial rules said, beside what is true.

    Raises:
        InputError: they have not judged every session.
    """
    said = judgements(suite).every()
    next_step = f"Go on with --part rules, or remove {suite.rules}."
    suite.check_every(lambda name: name in said, "the rules have not judged every session", next_step)
    true = suite.true()
    rules = next(iter(said.values()))
    return {rule: tuple(Case(answer, said[answer.session][rule]) for answer in true) for rule in rules}


def score_without(suite: SuiteFolder) -> tuple[Case, ...]:
    """The diagnoses whose catalogue lacked the effect that is there, beside what is true.

    Raises:
        InputError: as of `score_suite`, or a diagnosis was made by another catalogue.
    """
    answers = {answer.session: answer for answer in suite.true() if answer.kind == "single"}
    told = _all_told(suite, tuple(answers), lambda name: _told(suite.without / name, frozenset(answers[name].effects)))
    return tuple(Case(answer, told[name]) for name, answer in answers.items())


def score_followed(suite: SuiteFolder) -> tuple[list[tuple[str, Told]], int]:
    """Each effect that was one of several with what was told with the trial more; and how many were not followed.

    Raises:
        InputError: as of `score_suite`.
    """
    every = wanted(suite)
    effects = {name: each.effect for name, each in every.items() if was_followed(suite, each)}
    told = _all_told(suite, tuple(effects), lambda name: _told(suite.followed / name))
    return [(effect, told[name]) for name, effect in effects.items()], len(every) - len(effects)


def _told(session: Path, lacking: frozenset[str] = frozenset()) -> Told:
    """With the time that it took, where only the benchmark knows."""
    told, clock = read_told(session / DIAGNOSIS, lacking), session / SECONDS
    return replace(told, seconds=float(clock.read_text())) if told.seconds is None and clock.exists() else told


def _all_told(suite: SuiteFolder, names: Sequence[str], told: Callable[[str], Told]) -> dict[str, Told]:
    """Of sessions, by name; all faults at once."""
    faults, diagnoses = FaultCollector(str(suite.folder)), {}
    for name in names:
        try:
            diagnoses[name] = told(name)
        except InputError as error:
            faults.extend_capped(list(error.faults))
    faults.raise_if_any()
    return diagnoses


def _reachable(cases: Sequence[Case]) -> Table:
    chosen = {"unexplained outside": of_kind("outside"), "two": of_kind("double"), "stage": has_stage}
    shares = {label: reachable(cases, counts) for label, counts in chosen.items()}
    rows = tuple((label, f"{100 * share:.0f} %") for label, share in shares.items() if share == share)
    caption = "What a matched filter that knows what to look for would see, with one false alarm in a hundred"
    return Table(caption, ("of all", "sees"), rows)
