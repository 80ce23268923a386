"""Opens the answers of a suite and scores what was said of its sessions."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from benchmarks.effects.folder import DIAGNOSIS, SECONDS, SuiteFolder
from benchmarks.effects.followed import FollowedScore
from benchmarks.effects.following import wanted, was_followed
from benchmarks.effects.rules import RULES
from benchmarks.effects.score import Score, scored
from benchmarks.effects.together import TogetherScore
from benchmarks.effects.told import Told, read_told
from benchmarks.effects.without import WithoutScore
from diagnosis.diagnosis import ALL_AT_ONCE
from session import FaultCollector, InputError

PROGRAM = "diagnosis"


@dataclass(frozen=True)
class Outcome:
    """What came of a suite.

    Attributes:
        scores: of the program and of the trivial rules, as far as they were run, by name.
        without: of the program whose catalogue lacked the effect that is there; None where that was not run.
        followed: of sessions with the trial that was recommended; None where that was not run.
    """

    scores: Mapping[str, Score]
    without: WithoutScore | None = None
    followed: FollowedScore | None = None

    @property
    def together(self) -> TogetherScore | None:
        """Of all effects at once; None where no diagnosis was asked for them."""
        score = self.scores.get(PROGRAM)
        asked = [] if score is None else [case for case in score.cases if case.told.effort in ALL_AT_ONCE]
        return TogetherScore(Score(tuple(asked))) if asked else None

    def to_json(self) -> dict[str, Any]:
        """Plain numbers."""
        plain = {name: score.to_json() for name, score in self.scores.items()}
        more = {
            "without_the_effect": self.without,
            "with_the_recommended_trial": self.followed,
            "all_effects_at_once": self.together,
        }
        return plain | {name: score.to_json() for name, score in more.items() if score is not None}


def score_all(suite: SuiteFolder) -> Outcome:
    """Scores whatever stands in the folder of a suite: rules, diagnoses, those without the effect or with a trial more.

    Raises:
        InputError: not every session is diagnosed, or not judged by rules that were run; or an answer has another
            checksum.
    """
    suite.check_diagnosed()
    scores = {PROGRAM: score_suite(suite)}
    if suite.rules.exists():
        scores |= score_rules(suite)
    without = score_without(suite) if suite.without.exists() else None
    return Outcome(scores, without, score_followed(suite) if suite.followed.exists() else None)


def score_suite(suite: SuiteFolder, told: Callable[[str], Told] | None = None) -> Score:
    """Scores the diagnoses in the folders of the sessions, of any program.

    Args:
        suite: whose sessions were diagnosed.
        told: of a session by its name; default: its `results/diagnosis.json`.

    Raises:
        InputError: a diagnosis is missing or not by the contract, or an answer has another checksum; all at once.
    """
    found = _all_told(suite, suite.names, told or (lambda name: _told(suite.sessions / name)))
    return scored(suite.true(), found)  # opened last: a diagnosis that is still to come could have seen them


def score_rules(suite: SuiteFolder) -> dict[str, Score]:
    """Scores what the trivial rules said.

    Raises:
        InputError: they have not judged every session, or as of `score_suite`.
    """
    suite.check_every(
        lambda name: all(suite.rule(rule, name).exists() for rule in RULES),
        "the rules have not judged every session",
        f"Go on with --part rules, or remove {suite.rules}.",
    )
    return {rule: score_suite(suite, lambda name, rule=rule: read_told(suite.rule(rule, name))) for rule in RULES}  # type: ignore[misc]


def score_without(suite: SuiteFolder) -> WithoutScore:
    """Scores the diagnoses whose catalogue lacked the effect that is there.

    Raises:
        InputError: as of `score_suite`, or a diagnosis was made by another catalogue.
    """
    answers = [answer for answer in suite.true() if answer.kind == "single"]
    lacking = {answer.session: frozenset(answer.effects) for answer in answers}
    told = _all_told(suite, tuple(lacking), lambda name: _told(suite.without / name, lacking[name]))
    return WithoutScore(scored(answers, told))


def score_followed(suite: SuiteFolder) -> FollowedScore:
    """Scores the diagnoses of sessions with the trial that was recommended, those that were not followed counted.

    Raises:
        InputError: as of `score_suite`.
    """
    all_wanted = wanted(suite)
    left = {name: each.confused.effect for name, each in all_wanted.items() if was_followed(suite, each)}
    told = _all_told(suite, tuple(left), lambda name: _told(suite.followed / name))
    return FollowedScore(tuple(left.values()), tuple(told), len(all_wanted) - len(left))


def _told(session: Path, lacking: frozenset[str] = frozenset()) -> Told:
    """With the time that it took, where only the benchmark knows."""
    told, clock = read_told(session / DIAGNOSIS, lacking), session / SECONDS
    return replace(told, seconds=float(clock.read_text())) if told.seconds is None and clock.exists() else told


def _all_told(suite: SuiteFolder, names: Sequence[str], told: Callable[[str], Told]) -> list[Told]:
    """Of sessions, in order; all faults at once."""
    faults, diagnoses = FaultCollector(str(suite.folder)), []
    for name in names:
        try:
            diagnoses.append(told(name))
        except InputError as error:
            faults.extend_capped(list(error.faults))
    faults.raise_if_any()
    return diagnoses
