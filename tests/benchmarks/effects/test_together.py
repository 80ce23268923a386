"""What all effects at once are worth is counted where they are called for, against what one would use without them."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.effects.answer import Answer
from benchmarks.effects.cases import read_cases, write_cases
from benchmarks.effects.report import outcome_text
from benchmarks.effects.score import Score, scored
from benchmarks.effects.scores_page import render_scores
from benchmarks.effects.scoring import PROGRAM, Outcome
from benchmarks.effects.together import TogetherScore
from benchmarks.effects.told import Forecast, Told

MANY = ("tendon_slack", "wave_drag", "bend_offset", "scale_error", "lens_distortion")
NOTHING = Told("no_gap", (), {"none_of_these": 0.1}, {}, None, None, 9.0, effort="full")


def told(*, named: float | None, together: float | None, plain: float = 0.010) -> Told:
    """With these errors of held-out speeds, m/s."""
    return Told(
        "unexplained" if named is None else "named",
        () if named is None else (("wave_drag",),),
        {"wave_drag": 0.4, "none_of_these": 0.9},
        {},
        None,
        None,
        9.0,
        effort="full",
        named=None if named is None else Forecast(0.1, plain, named),
        together=None if together is None else Forecast(0.3, plain, together),
    )


@pytest.fixture(scope="module")
def score() -> Score:
    answers = [Answer("n", "null"), *(Answer(f"m{i}", "many", MANY, detectability=3.3) for i in range(4))]
    found = [
        told(named=0.004, together=0.006),  # better than plain, worse than with the name
        told(named=None, together=0.012),  # worse than plain, which is all that there is without
        told(named=0.011, together=0.002),
        told(named=0.003, together=None),
    ]
    return scored(answers, [NOTHING, *found])


def test_it_counts_where_they_are_called_for_and_against_what_there_is_without_them(score: Score) -> None:
    counted = TogetherScore(score)
    assert counted.called_for == {"null": (0, 1), "many": (3, 4)}
    assert counted.nearer == {"than_plain": (2, 3), "than_without": (1, 3)}
    errors = {what: error.value for what, error in counted.speed_errors.items()}
    assert errors == pytest.approx({"plain": 0.010, "without": 0.010, "together": 0.006})
    assert counted.shrinkage.value == pytest.approx(0.3)


def test_it_is_told_in_every_place_where_scores_are(score: Score, tmp_path: Path) -> None:
    outcome = Outcome({PROGRAM: score})
    text = outcome_text(outcome)
    assert "75 % (30 % to 95 %)" in next(
        line for line in text.splitlines() if line.startswith("called for, many small")
    )
    assert 'id="together"' in render_scores(outcome)
    write_cases(tmp_path / "cases.jsonl", score)
    again = Outcome({PROGRAM: read_cases(tmp_path / "cases.jsonl")})
    assert json.dumps(again.to_json()) == json.dumps(outcome.to_json())


def test_a_suite_that_was_not_asked_tells_nothing_of_it() -> None:
    outcome = Outcome({PROGRAM: scored([Answer("n", "null")], [replace(NOTHING, effort="quick")])})
    assert outcome.together is None
    assert "all effects at once" not in outcome_text(outcome)
    assert 'id="together"' not in render_scores(outcome)


def test_a_suite_that_was_asked_tells_also_that_nothing_calls_for_it() -> None:
    outcome = Outcome({PROGRAM: scored([Answer("n", "null")], [NOTHING])})
    assert outcome.together is not None
    assert outcome.together.called_for == {"null": (0, 1)}
    assert "called for, nothing there" in outcome_text(outcome)


def test_a_session_in_which_no_held_out_swim_counts_is_no_comparison() -> None:
    blank = Told("unexplained", (), {}, {}, None, None, None, together=Forecast())
    counted = TogetherScore(scored([Answer("m", "many", MANY)], [blank]))
    assert counted.called_for["many"] == (1, 1)
    assert counted.nearer == {"than_plain": (0, 0), "than_without": (0, 0)}
