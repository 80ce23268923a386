"""The page of a suite shows the numbers of its score and needs nothing but itself."""

import json
from html.parser import HTMLParser
from pathlib import Path

import pytest

from benchmarks.effects.answer import Answer
from benchmarks.effects.folder import SuiteFolder
from benchmarks.effects.goals import GOALS, GOALS_WITHOUT, Goal
from benchmarks.effects.report import outcome_text
from benchmarks.effects.score import Score, scored
from benchmarks.effects.scores_page import render_scores, write_scores
from benchmarks.effects.scoring import Outcome
from benchmarks.effects.told import Told
from benchmarks.effects.without import WithoutScore

SLACK = Answer("s", "single", ("tendon_slack",), None, (("joint_friction",),), 5.0, "tail", 0.8)
ANSWERS = [Answer("n", "null")] * 3 + [SLACK] * 4
QUIET = Told("no_gap", (), {"none_of_these": 1.0}, {}, None, None, 12.0)
RIGHT = Told("named", (("tendon_slack",),), {"tendon_slack": 0.9}, {"tail": 0.7}, 0.75, (0.6, 0.85), 12.0)
WRONG = Told("named", (("wave_drag",),), {"wave_drag": 0.6, "tendon_slack": 0.3}, {"body": 0.7}, 0.2, (0.1, 0.3), 12.0)


def score(*told: Told) -> Score:
    return scored(ANSWERS, told)


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    diagnosis = score(QUIET, QUIET, WRONG, RIGHT, RIGHT, RIGHT, WRONG)
    rule = score(QUIET, WRONG, WRONG, WRONG, WRONG, WRONG, RIGHT)
    without = scored([SLACK], [Told("unexplained", (), {"none_of_these": 1.0}, {"tail": 0.6}, None, None, 9.0)])
    return Outcome({"diagnosis": diagnosis, "chance": rule}, WithoutScore(without))


class Page(HTMLParser):
    """Text, ids, and what the page would load."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.words: list[str] = []
        self.ids: list[str] = []
        self.loads: list[str] = []
        self.feed(text)

    def handle_starttag(self, _tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name == "id":
                self.ids.append(value or "")
            if name in ("src", "href", "xlink:href") and not (value or "").startswith(("#", "data:")):
                self.loads.append(value or "")

    def handle_data(self, data: str) -> None:
        self.words.append(data.strip())


def test_the_page_shows_every_goal_beside_what_was_reached(outcome: Outcome) -> None:
    page = Page(render_scores(outcome))
    for goal in (*GOALS.values(), *GOALS_WITHOUT.values()):
        assert goal.label in page.words
        assert goal.asked in page.words
    assert "75 % (30 % to 95 %)" in page.words  # three of four right names first
    assert "25 %" in page.words  # of the rule
    assert "joint friction" in page.words  # a look-alike
    assert page.loads == []
    assert len(page.ids) == len(set(page.ids))
    figures = {"goals", "by_detectability", "reliability", "confusion", "shrinkage", "without_goals"}
    assert figures <= set(page.ids)


def test_rules_alone_make_a_page_without_what_they_do_not_tell() -> None:
    told = [Told("no_gap", (), {"none_of_these": 1.0}, {}, None, None, None)] * 7
    page = Page(render_scores(Outcome({"chance": score(*told)})))
    assert {"goals", "confusion"} <= set(page.ids)
    assert not {"shrinkage", "without_goals"} & set(page.ids)


def test_the_files_hold_the_same_numbers(outcome: Outcome, tmp_path: Path) -> None:
    write_scores(SuiteFolder(tmp_path), outcome)
    stands = json.loads((tmp_path / "scores.json").read_text())
    assert stands["diagnosis"]["headline"]["right_first"]["share"] == 0.75
    assert stands["diagnosis"]["confusion"] == {"tendon_slack": {"tendon_slack": 3, "wave_drag": 1}}
    assert stands["without_the_effect"]["headline"]["unexplained"]["hits"] == 1
    pictures = {path.stem: path.read_bytes()[:4] for path in (tmp_path / "figures").iterdir()}
    assert set(pictures.values()) == {b"\x89PNG"}
    assert len(pictures) == 7
    assert "75 % (30 % to 95 %)" in outcome_text(outcome)


def test_the_share_on_the_true_stage_is_a_median() -> None:
    elsewhere = Told("unexplained", (), {"none_of_these": 1.0}, {"tail": 0.1, "body": 0.8}, None, None, 9.0)
    assert scored([SLACK] * 3, [RIGHT, elsewhere, elsewhere]).share_on_stage.value == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("goal", "asked"),
    [(Goal("", 0.0, 0.01), "≤ 1 %"), (Goal("", 0.85, 1.0), "≥ 85 %"), (Goal("", 0.92, 0.98), "92 to 98 %")],
)
def test_what_is_asked_in_words(goal: Goal, asked: str) -> None:
    assert goal.asked == asked
