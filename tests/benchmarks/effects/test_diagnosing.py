"""A program is run over a suite once for each session, and reported no more than what its catalogue is to lack."""

import json
import sys
from pathlib import Path

import pytest

from benchmarks.cases import Run
from benchmarks.effects.diagnosing import diagnose, diagnose_suite, diagnose_without, program_of
from benchmarks.effects.folder import DIAGNOSIS, SuiteFolder
from benchmarks.effects.score import measures_without
from benchmarks.effects.scoring import score_suite, score_without, scores_of
from benchmarks.scores import Scores
from calib.options import Options
from swimcal.errors import InputError
from tests.benchmarks.effects.suites import ANSWERS, runs, says_slack, suite_in
from tests.calib.door import Front
from tests.cases import later

ALONE = Run(workers=1)
NAMES = [answer.session for answer in ANSWERS]


@pytest.fixture
def suite(tmp_path: Path) -> SuiteFolder:
    return suite_in(tmp_path)


def fails_on_the_third(session: Path, without: frozenset[str]) -> None:
    if session.name == NAMES[2]:
        raise KeyError("a marker")
    says_slack(session, without)


@pytest.mark.parametrize("workers", [1, *later(2)])
def test_every_session_is_diagnosed_once_and_then_left_alone(suite: SuiteFolder, workers: int) -> None:
    assert diagnose_suite(suite, says_slack, Run(workers)) == ()
    assert diagnose_suite(suite, says_slack, Run(workers)) == ()
    assert runs(suite.sessions) == dict.fromkeys(NAMES, 1)


def test_what_fails_is_told_and_tried_again_and_stops_no_other(suite: SuiteFolder) -> None:
    failures = diagnose_suite(suite, fails_on_the_third, ALONE)
    assert [failure.name for failure in failures] == [NAMES[2]]
    assert failures[0].message == "KeyError: 'a marker'"
    with pytest.raises(InputError, match="1 of 4 are missing"):
        score_suite(suite)
    assert diagnose_suite(suite, says_slack, ALONE) == ()
    assert runs(suite.sessions) == dict.fromkeys(NAMES, 1)


def test_a_program_that_writes_nothing_has_failed(suite: SuiteFolder) -> None:
    failures = diagnose_suite(suite, lambda *_: None, ALONE)
    assert [failure.message for failure in failures] == [f"FileNotFoundError: ended without a {DIAGNOSIS}"] * len(NAMES)


def test_without_the_effect_the_sessions_with_one_are_diagnosed_in_copies(suite: SuiteFolder) -> None:
    diagnose_suite(suite, says_slack, ALONE)
    before = (suite.sessions / NAMES[1] / DIAGNOSIS).read_text()
    assert diagnose_without(suite, says_slack, ALONE) == ()
    assert diagnose_without(suite, says_slack, ALONE) == ()
    assert runs(suite.without) == {NAMES[1]: 2, NAMES[2]: 2}  # one is copied with the session
    withheld = {
        name: json.loads((suite.without / name / DIAGNOSIS).read_text())["withheld_from_catalogue"]
        for name in NAMES[1:3]
    }
    assert withheld == {NAMES[1]: ["tendon_slack"], NAMES[2]: ["scale_error"]}
    assert (suite.sessions / NAMES[1] / DIAGNOSIS).read_text() == before
    assert not list(suite.without.rglob("answers"))


def test_scores_without_the_effect(suite: SuiteFolder) -> None:
    """Clear slack is unexplained and on its stage; where the scale is off, slack is reported with confidence."""
    diagnose_suite(suite, says_slack, ALONE)
    diagnose_without(suite, says_slack, ALONE)
    found = measures_without(score_without(suite))
    assert {name: tuple(row.found) for name, row in found.items()} == {
        "unexplained": (1, 1),
        "stage_right": (1, 1),
        "confident_wrong": (1, 2),
    }
    seconds = [case.diagnosis.seconds for case in score_suite(suite)]  # measured, as the program does not tell
    assert all(each is not None and 0.0 <= each < 10.0 for each in seconds)
    assert "Without the effect that is there" in scores_of(score_suite(suite), score_without(suite), "").text()


def test_a_diagnosis_by_the_wrong_catalogue_is_refused(suite: SuiteFolder) -> None:
    diagnose_suite(suite, lambda session, _: says_slack(session, frozenset({"wave_drag"})), ALONE)
    with pytest.raises(InputError, match=r"(?s)another catalogue.*wave_drag.*nothing withheld"):
        score_suite(suite)
    diagnose_without(suite, lambda session, _: says_slack(session, frozenset()), ALONE)
    with pytest.raises(InputError, match=r"(?s)another catalogue.*nothing withheld.*tendon_slack"):
        score_without(suite)


def test_no_answer_is_opened_while_a_diagnosis_is_missing(suite: SuiteFolder, monkeypatch: pytest.MonkeyPatch) -> None:
    def opened(_suite: SuiteFolder) -> None:
        raise AssertionError

    monkeypatch.setattr(SuiteFolder, "true", opened)
    with pytest.raises(InputError, match=rf"{len(NAMES)} of {len(NAMES)} are missing.*--part diagnose"):
        diagnose_without(suite, says_slack, ALONE)
    with pytest.raises(InputError, match=r"not every session is diagnosed.*--part diagnose"):
        score_suite(suite)
    assert not suite.without.exists()


def test_the_toolkit_s_own_program_is_told_what_to_leave_out(
    suite: SuiteFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[Path, str, frozenset[str]]] = []

    class Recorded:
        def __init__(self, session: Path, options: Options) -> None:
            self.session, self.effort = session, options.effort

        def diagnosis(self, without: frozenset[str]) -> None:
            asked.append((self.session, self.effort, without))

    monkeypatch.setattr("benchmarks.effects.diagnosing.open_session", lambda folder: folder)
    monkeypatch.setattr("benchmarks.effects.diagnosing.Pipeline", Recorded)
    diagnose(suite.sessions / NAMES[0], frozenset({"wave_drag"}))
    assert asked == [(suite.sessions / NAMES[0], "quick", frozenset({"wave_drag"}))]


def program_that_says(reported: str, folder: Path) -> str:
    """A command that writes an expression as the diagnosis."""
    script = folder / "program.py"
    script.write_text(
        "import json, pathlib, sys\n"
        "path = pathlib.Path(sys.argv[1]) / 'results' / 'diagnosis.json'\n"
        "path.parent.mkdir(exist_ok=True)\n"
        f"path.write_text(json.dumps({reported}))\n"
    )
    return f"{sys.executable} {script}"


def test_any_command_may_be_the_program(suite: SuiteFolder, tmp_path: Path) -> None:
    program = program_of(program_that_says("{'said': sys.argv[2:]}", tmp_path))
    assert diagnose_suite(suite, program, ALONE) == ()
    assert diagnose_without(suite, program, ALONE) == ()
    whole, lacking = (json.loads((each / NAMES[1] / DIAGNOSIS).read_text()) for each in (suite.sessions, suite.without))
    assert whole["said"] == []
    assert lacking["said"] == ["--exclude", "tendon_slack"]


def test_a_command_that_fails_is_told_with_its_last_words(suite: SuiteFolder) -> None:
    program = program_of(f"""{sys.executable} -c "raise SystemExit('no such camera')" """)
    failures = diagnose_suite(suite, program, ALONE)
    assert {failure.message for failure in failures} == {"ProgramFailed: ended with status 1: no such camera"}


def test_the_command_line_diagnoses_withholds_and_scores(suite: SuiteFolder, benchmarks: Front, tmp_path: Path) -> None:
    """A program that says there is no gap anywhere: right of the null session, and of nothing else."""
    none = "{'verdict': 'no_gap', 'groups': [], 'probabilities': {'none_of_these': 1.0}, 'where': None, 'gap': None}"
    program = program_that_says(f"{none} | {{'withheld_from_catalogue': sys.argv[3:]}}", tmp_path)
    effects = ("effects", suite.folder)
    early = benchmarks(*effects, "--part", "score")
    assert early.code == 2
    assert "not every session is diagnosed" in early.err
    assert "--part diagnose" in early.err
    for part in ("diagnose", "withhold"):
        ended = benchmarks(*effects, "--part", part, "--program", program, "--workers", "1")
        assert (ended.code, ended.out.strip()) == (0, "all done")
    ended = benchmarks(*effects, "--part", "score", "--json")
    scores = Scores.read(suite.folder / "scores.json")
    assert ended.out == scores.json()
    rows = {row[0]: row[2] for table in scores.tables for row in table.rows if len(row) > 2}
    assert rows["alarm where there is nothing"].startswith("0 of 1 ")
    assert rows["right name first, d ≥ 5"].startswith("0 of 1 ")
    assert rows["unexplained, d ≥ 5"].startswith("0 of 1 ")
    again = benchmarks("effects", suite.folder / "cases.jsonl", "--part", "score")
    assert scores.tables[0].text() in again.out
