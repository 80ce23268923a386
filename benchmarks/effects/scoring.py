"""Scorer of a suite: it opens the answers and compares the diagnoses of the sessions with them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from benchmarks.cases import read_lines
from benchmarks.effects.folder import DIAGNOSIS, SECONDS, SuiteFolder
from benchmarks.effects.score import Case, has_stage, measures, measures_without, of_kind, reachable
from benchmarks.effects.scored_diagnosis import Diagnosis, read_diagnosis
from benchmarks.scores import Scores, Table
from swimcal.errors import FaultCollector, InputError

PROGRAM = "diagnosis"
_NOTES = (
    "d: detectability, distance of the response of an effect from its nearest rival, refitted, in standard "
    "deviations of noise, nuisances and discrepancy.",
    "95 % intervals: of shares by Wilson, of numbers by drawing sessions anew, of chance by drawing what comes true.",
)


def scores_of(cases: Sequence[Case], without: Sequence[Case], command: str) -> Scores:
    """Build all tables, with the command that made them.

    Args:
        cases: cases of the program.
        without: cases of the program whose catalogue lacked the effect that is there.
        command: the command.
    """
    kinds = [case.answer.kind for case in cases]
    counts = ", ".join(f"{kinds.count(kind)} {kind}" for kind in dict.fromkeys(sorted(kinds)))
    tables = [Table.of(f"{len(kinds)} sessions: {counts}", {PROGRAM: measures(cases)})]
    if without:
        caption = "Without the effect that is there in the catalogue"
        tables.append(Table.of(caption, {PROGRAM: measures_without(without)}))
    tables.append(_build_reachable_table(cases))
    return Scores(
        title="Withheld effects",
        data="synthetic: sessions of a second simulator, the effect withheld from what diagnoses them",
        command=command,
        tables=tuple(table for table in tables if table.rows),
        notes=_NOTES,
    )


def read_cases(path: Path) -> tuple[Case, ...]:
    """Read cases in a file, of one shard or of several, one after the other.

    Raises:
        InputError: it holds no cases.
    """
    return read_lines(path, Case, lambda case: case.answer.session)


def score_suite(suite: SuiteFolder) -> tuple[Case, ...]:
    """Read the diagnoses in the folders of the sessions, of any program, with the answers.

    Raises:
        InputError: not every session is diagnosed, or a diagnosis is not by the contract; all at once.
    """
    suite.check_diagnosed()
    found = _read_diagnoses(suite.sessions, dict.fromkeys(suite.names, frozenset[str]()))
    true = suite.true()  # opened last: a diagnosis that is still to come could have seen them
    return tuple(Case(answer, found[answer.session]) for answer in true)


def score_without(suite: SuiteFolder) -> tuple[Case, ...]:
    """Read the diagnoses whose catalogue lacked the effect that is there, if there are any, with the answers.

    Raises:
        InputError: as of `score_suite`, or a diagnosis was made by another catalogue.
    """
    answers = suite.singles if suite.without.exists() else {}
    found = _read_diagnoses(suite.without, {name: frozenset(answer.effects) for name, answer in answers.items()})
    return tuple(Case(answer, found[name]) for name, answer in answers.items())


def _read_diagnoses(folder: Path, lacking: Mapping[str, frozenset[str]]) -> dict[str, Diagnosis]:
    """Read diagnoses by session and by what their catalogue lacks; add the time, where only the benchmark knows it."""
    faults, diagnoses = FaultCollector(str(folder.parent)), {}
    for name, effects in lacking.items():
        clock = folder / name / SECONDS
        try:
            found = read_diagnosis(folder / name / DIAGNOSIS, effects)
            untimed = found.seconds is None and clock.exists()
            diagnoses[name] = replace(found, seconds=float(clock.read_text(encoding="utf-8"))) if untimed else found
        except InputError as error:
            faults.extend_capped(list(error.faults))
    faults.raise_if_any()
    return diagnoses


def _build_reachable_table(cases: Sequence[Case]) -> Table:
    chosen = {"unexplained outside": of_kind("outside"), "two": of_kind("double"), "stage": has_stage}
    shares = {label: reachable(cases, counts) for label, counts in chosen.items()}
    rows = tuple((label, f"{100 * share:.0f} %") for label, share in shares.items() if share == share)
    caption = "What a matched filter that knows what to look for would see, with one false alarm in a hundred"
    return Table(caption, ("of all", "sees"), rows)
