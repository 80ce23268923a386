"""Sessions of the exported twin in plain MuJoCo: their plans, their making, and the scores of what is said of them."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from benchmarks.effects.plain import (
    CHANGES,
    PlainAnswer,
    PlainPlan,
    make_plain,
    plan_plain,
)
from benchmarks.effects.plain_scoring import PlainCase, scores_of_plain
from benchmarks.effects.scored_diagnosis import Diagnosis
from swimcal.effects.catalogue import catalogue
from swimcal.session import load_session

Verdict = Literal["named", "inseparable", "unexplained", "no_gap"]


def test_plans_hold_each_change_once_in_an_order_that_tells_nothing() -> None:
    plans = plan_plain(3, 2, len(CHANGES))
    assert sorted(plan.change for plan in plans if plan.change) == sorted(CHANGES)
    assert plans[0].change is not None or plans[1].change is not None
    assert plans == plan_plain(3, 2, len(CHANGES))
    assert plans != plan_plain(4, 2, len(CHANGES))


def test_every_change_is_told_by_effects_of_the_catalogue() -> None:
    for name, change in CHANGES.items():
        made = change(1.0)
        assert set(made.right) <= set(catalogue()), name
        assert made.stage == catalogue()[made.right[0]].stage if made.right else made.stage


@pytest.mark.long
def test_a_session_is_one_like_any_users_and_the_change_is_in_it(tmp_path: Path) -> None:
    plans = (PlainPlan("m000", 7, None), PlainPlan("m001", 7, "stiffer"), PlainPlan("m002", 7, None))
    assert make_plain(tmp_path, plans) == 3
    assert make_plain(tmp_path, plans) == 0
    sessions = [load_session(tmp_path / plan.name) for plan in plans]
    assert [trial.role for trial in sessions[0].trials] == ["fit", "fit", "holdout", "fit", "holdout", "fit"]
    first, stiffer, again = (
        np.loadtxt(path, delimiter=",", skiprows=1)
        for path in [sorted((tmp_path / plan.name / "trials").iterdir())[0] for plan in plans]
    )
    assert (first == again).all()  # the seed decides
    assert first.shape == stiffer.shape
    assert np.sqrt(np.mean((first - stiffer) ** 2)) > 5  # px
    assert not any("m00" in path.name for path in (tmp_path / "m000").rglob("*"))


def case(change: str | None, right: tuple[str, ...], verdict: Verdict, named: str = "", **chances: float) -> PlainCase:
    answer = PlainAnswer("m000", change, 1.0, right, "tail", 0)
    return PlainCase(answer, Diagnosis(verdict, ((named, "other"),) if named else (), chances))


@pytest.mark.parametrize(
    ("told", "right"),
    [
        (case(None, (), "no_gap"), True),
        (case(None, (), "unexplained"), False),
        (case("slack", ("tendon_slack",), "named", "tendon_slack", tendon_slack=0.95), True),
        (case("slack", ("tendon_slack",), "named", "tendon_friction", tendon_friction=0.7), False),
        (case("slack", ("tendon_slack",), "unexplained"), False),
        (case("gust", (), "unexplained"), True),
        (case("gust", (), "named", "wave_drag", wave_drag=0.6), False),
    ],
)
def test_what_is_right(told: PlainCase, right: bool) -> None:
    assert told.right == right


def test_scores_count_what_is_sure_and_wrong() -> None:
    cases = [
        case("slack", ("tendon_slack",), "named", "tendon_slack", tendon_slack=0.95),
        case("gust", (), "named", "wave_drag", wave_drag=0.95),
    ]
    rows = {row[0]: row[-1] for row in scores_of_plain(cases, "a command").tables[0].rows}
    assert rows["all sessions: right"].startswith("1 of 2")
    assert rows["wrong and sure (above 0.9)"].startswith("1 of 2")
