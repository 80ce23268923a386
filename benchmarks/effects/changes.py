"""Sessions with one change or none, from plan to score: what pairs, real pairs and those of plain MuJoCo share.

Answers are in `folder/answers`, apart from the sessions; only `score_changes` opens them.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from benchmarks.cases import Failure, Run, run_cases, write_record
from benchmarks.effects.folder import DIAGNOSIS
from benchmarks.effects.scored_diagnosis import Diagnosis, read_diagnosis
from benchmarks.effects.suite import in_turn
from benchmarks.scores import Measure, Scores, Share, Table
from calib.options import Options
from calib.pipeline import Pipeline, open_session
from swimcal.results import from_plain

REFERENCE, CHANGED = "reference", "changed"
"""Names of the two sessions in the folder of a pair."""
PLAIN = "plain"
"""Generator of sessions without a reference: the exported twin in plain MuJoCo."""
_SURE = 0.9  # A probability above this is sure.


class ChangePlan(NamedTuple):
    """Plan of one pair or session: its name, seed and change; None for none."""

    name: str
    seed: int
    change: str | None


@dataclass(frozen=True)
class ChangeAnswer:
    """Answer of one pair or session."""

    name: str
    generator: str  # "reality", "wake", "real" or "plain"
    change: str | None  # None for none
    right: tuple[str, ...]  # names that the catalogue has for the change; none where it lacks it
    strength: float
    seed: int

    def write(self, folder: Path) -> None:
        """Write the answer next to the others of a folder."""
        write_record(_file_of(folder, self.name), self)


@dataclass(frozen=True)
class ChangeCase:
    """Answer and diagnosis of one pair or session."""

    answer: ChangeAnswer
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
    def named_first(self) -> bool:
        """Whether the very first name is that of the change."""
        return bool(self.told.groups) and self.told.groups[0][0] in self.answer.right

    @property
    def sure_and_wrong(self) -> bool:
        """Whether another effect has a probability above 0.9."""
        return any(p > _SURE for name, p in self.told.probability_of.items() if name not in self.answer.right)


def plan_changes(
    key: tuple[int, int], letter: str, unchanged: int, names: Sequence[str], changed: int
) -> tuple[ChangePlan, ...]:
    """Plan in random order, the changes in turn; names carry no information.

    Args:
        key: seed of all draws, and the number of the kind of sessions.
        letter: letter with which the names begin.
        unchanged: how many are to have no change.
        names: names of the changes.
        changed: how many are to have one.
    """
    random = np.random.default_rng(key)
    changes = [*[None] * unchanged, *in_turn(names, changed, random)]
    seeds, order = random.integers(2**31, size=len(changes)), random.permutation(len(changes))
    return tuple(ChangePlan(f"{letter}{n:03d}", int(seeds[i]), changes[i]) for n, i in enumerate(order))


def missing(folder: Path, plans: Sequence[ChangePlan]) -> list[ChangePlan]:
    """Return the plans whose answer the folder lacks."""
    return [plan for plan in plans if not _file_of(folder, plan.name).exists()]


def diagnose_changes(folder: Path, run: Run) -> tuple[Failure, ...]:
    """Diagnose what has no diagnosis yet, as `calib diagnose` does, the second session of a pair with its reference."""
    there = {path.stem: folder / path.stem for path in sorted((folder / "answers").glob("*.json"))}
    return run_cases(diagnose_change, {name: at for name, at in there.items() if not _diagnosis_in(at).exists()}, run)


@threadpool_limits.wrap(limits=1, user_api="blas")  # small matrices, for which threads only wait
def diagnose_change(at: Path) -> None:
    """Diagnose one session or pair at quick effort, on one core."""
    session, reference = (at / CHANGED, at / REFERENCE) if (at / CHANGED).exists() else (at, None)
    Pipeline(open_session(session), Options("quick", workers=1)).diagnosis(reference=reference)


def score_changes(folder: Path) -> tuple[ChangeCase, ...]:
    """Read answers and diagnoses of all that is diagnosed.

    Raises:
        InputError: a diagnosis is not by the contract.
    """
    return tuple(
        ChangeCase(from_plain(ChangeAnswer, json.loads(path.read_bytes())), read_diagnosis(found))
        for path in sorted((folder / "answers").glob("*.json"))
        if (found := _diagnosis_in(folder / path.stem)).exists()
    )


def scores_of(cases: Sequence[ChangeCase], command: str) -> Scores:
    """Return the tables of the scores."""
    of_pairs, share = not any(case.answer.generator == PLAIN for case in cases), Share.among
    unchanged = [case for case in cases if case.answer.change is None]
    changed = [case for case in cases if case.answer.right]
    lacking = [case for case in cases if case.answer.change is not None and not case.answer.right]
    measures = [Measure("wrong and sure (above 0.9)", share(cases, lambda c: c.sure_and_wrong), "0")]
    if of_pairs:
        title, caption = "Reference sessions", "Pairs of a healthy and a second session"
        measures += [
            Measure("healthy pairs: false alarms", share(unchanged, lambda c: not c.right), "1 of 20"),
            Measure("healthy pairs: an effect named", share(unchanged, lambda c: bool(c.told.groups)), "0"),
            Measure("changed, any d: named first", share(changed, lambda c: c.named_first)),
        ]
    else:
        title, caption = "Plain MuJoCo", "The exported twin in plain MuJoCo, one change each"
        measures += [
            Measure("all sessions: right", share(cases, lambda c: c.right), "92 %"),
            Measure("changes of the catalogue: named first", share(changed, lambda c: c.right)),
            Measure("no change: no gap", share(unchanged, lambda c: c.right)),
            Measure("changes that the catalogue lacks: unexplained", share(lacking, lambda c: c.right)),
        ]
    heads = ("name", "changed", "strength", "verdict", "named", "probability of the truth")
    rows = tuple(
        (
            case.answer.name,
            case.answer.change or "nothing",
            f"{case.answer.strength:.2f}",
            case.told.verdict,
            "; ".join(" or ".join(group) for group in case.told.groups),
            ", ".join(f"{name} {case.told.probabilities.get(name, 0.0):.2f}" for name in case.answer.right),
        )
        for case in cases
    )
    data = "real: pairs of public trials" if {case.answer.generator for case in cases} == {"real"} else "synthetic"
    found = Table.of(caption, {"found": {row.label: row for row in measures}})
    return Scores(title, data, command, (found, Table("Each by itself", heads, rows)))


def _file_of(folder: Path, name: str) -> Path:
    return folder / "answers" / f"{name}.json"


def _diagnosis_in(at: Path) -> Path:
    return (at / CHANGED if (at / CHANGED).exists() else at) / DIAGNOSIS
