"""Diagnoses of sessions in plain MuJoCo, and their scores; only `score_plain` opens the answers."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.cases import Failure, Run, run_cases
from benchmarks.effects.diagnosing import diagnose
from benchmarks.effects.folder import DIAGNOSIS
from benchmarks.effects.plain import PlainAnswer
from benchmarks.effects.scored_diagnosis import Diagnosis, read_diagnosis
from benchmarks.scores import Measure, Scores, Share, Table
from swimcal.results import from_plain

_SURE = 0.9  # A probability above this is sure.


@dataclass(frozen=True)
class PlainCase:
    """Answer and diagnosis of one session."""

    answer: PlainAnswer
    told: Diagnosis

    @property
    def right(self) -> bool:
        """Whether the first group holds the change, `no_gap` stands for none, `unexplained` for one of no catalogue."""
        if self.answer.change is None:
            return self.told.verdict == "no_gap"
        if not self.answer.right:
            return self.told.verdict == "unexplained"
        return bool(self.told.named_groups) and not set(self.answer.right).isdisjoint(self.told.named_groups[0])

    @property
    def sure_and_wrong(self) -> bool:
        """Whether another effect has a probability above 0.9."""
        return any(p > _SURE for name, p in self.told.probability_of.items() if name not in self.answer.right)


def diagnose_plain(folder: Path, run: Run) -> tuple[Failure, ...]:
    """Diagnose the sessions that have no diagnosis yet, as `calib diagnose --effort quick` does."""
    sessions = {path.parent.name: path.parent for path in sorted(folder.glob("m*/session.toml"))}
    return run_cases(diagnose, {name: at for name, at in sessions.items() if not (at / DIAGNOSIS).exists()}, run)


def score_plain(folder: Path) -> tuple[PlainCase, ...]:
    """Read answers and diagnoses of all sessions that are diagnosed.

    Raises:
        InputError: a diagnosis is not by the contract.
    """
    return tuple(
        PlainCase(from_plain(PlainAnswer, json.loads(path.read_bytes())), read_diagnosis(found))
        for path in sorted((folder / "answers").glob("m*.json"))
        if (found := folder / path.stem / DIAGNOSIS).exists()
    )


def scores_of_plain(cases: Sequence[PlainCase], command: str) -> Scores:
    """Return the table of the scores."""
    changed = [case for case in cases if case.answer.right]
    unchanged = [case for case in cases if case.answer.change is None]
    lacking = [case for case in cases if case.answer.change is not None and not case.answer.right]
    measures = {
        "right": Measure("all sessions: right", Share.among(cases, lambda c: c.right), "92 %"),
        "first": Measure("changes of the catalogue: named first", Share.among(changed, lambda c: c.right)),
        "none": Measure("no change: no gap", Share.among(unchanged, lambda c: c.right)),
        "lacking": Measure("changes that the catalogue lacks: unexplained", Share.among(lacking, lambda c: c.right)),
        "wrong": Measure("wrong and sure (above 0.9)", Share.among(cases, lambda c: c.sure_and_wrong), "0"),
    }
    rows = tuple(
        (
            case.answer.session,
            case.answer.change or "nothing",
            f"{case.answer.strength:.2f}",
            case.told.verdict,
            "; ".join(" or ".join(group) for group in case.told.groups),
            ", ".join(f"{name} {case.told.probabilities.get(name, 0.0):.2f}" for name in case.answer.right),
        )
        for case in cases
    )
    heads = ("session", "changed", "strength", "verdict", "named", "probability of the truth")
    table = Table.of("The exported twin in plain MuJoCo, one change each.", {"found": measures})
    return Scores("Plain MuJoCo", "synthetic sessions", command, (table, Table("Every session.", heads, rows)))
