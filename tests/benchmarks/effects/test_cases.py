"""What was scored once can be scored again from its lines, shards of a suite together."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from benchmarks.effects.cases import read_cases, write_cases
from benchmarks.effects.diagnosing import diagnose_suite
from benchmarks.effects.score import Score
from benchmarks.effects.scores_page import write_scores
from benchmarks.effects.scoring import score_all
from calib.cli import app
from session import InputError, plain_json
from tests.benchmarks.effects.suites import says_slack, suite_in


@pytest.fixture
def cases(tmp_path: Path) -> Path:
    suite = suite_in(tmp_path / "suite")
    assert diagnose_suite(suite, says_slack, workers=1) == ()
    write_scores(suite, score_all(suite))
    return suite.folder / "cases.jsonl"


def test_lines_score_as_the_suite_did(cases: Path) -> None:
    found, expected = read_cases(cases), json.loads((cases.parent / "scores.json").read_text())["diagnosis"]
    scored = plain_json(found.to_json())
    assert len(found.cases) == 4
    seconds, before = scored.pop("seconds"), expected.pop("seconds")
    assert seconds["value"] == pytest.approx(before["value"], abs=1e-6)
    assert scored == expected


def test_two_shards_are_scored_together(cases: Path, tmp_path: Path) -> None:
    whole = read_cases(cases)
    for number in (0, 1):
        write_cases(tmp_path / f"{number}.jsonl", Score(whole.cases[number::2]))
    both = tmp_path / "both.jsonl"
    both.write_text((tmp_path / "0.jsonl").read_text() + (tmp_path / "1.jsonl").read_text())
    assert read_cases(both).headline == whole.headline
    said = CliRunner().invoke(app, ["benchmark", "effects", str(both), "--part", "score", "--json"])
    assert said.exit_code == 0
    assert json.loads(said.stdout)["diagnosis"]["sessions"] == 4


def test_what_is_no_case_and_what_stands_twice_is_told_at_once(cases: Path) -> None:
    first = cases.read_text().splitlines()[0]
    without = json.loads(first)
    del without["told"]["verdict"]
    cases.write_text("\n".join([first, first, "{}", json.dumps(without)]) + "\n")
    with pytest.raises(InputError) as told:
        read_cases(cases)
    assert "a session stands there twice" in str(told.value)
    assert "line 3: is no case" in str(told.value)
    assert "verdict" in str(told.value)


def test_a_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_cases(tmp_path / "cases.jsonl")
