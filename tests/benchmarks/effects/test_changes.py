"""Pairs and sessions with one change: their plans, and the scores of what is said of them."""

from __future__ import annotations

from collections import Counter
from functools import partial
from pathlib import Path
from typing import Literal

import pytest

from benchmarks.effects.changes import PLAIN, ChangeAnswer, ChangeCase, missing, plan_changes, scores_of
from benchmarks.effects.making import GENERATORS
from benchmarks.effects.pairs import plan_pairs
from benchmarks.effects.plain import CHANGES, plan_plain
from benchmarks.effects.scored_diagnosis import Diagnosis
from swimcal.effects.catalogue import catalogue

Verdict = Literal["named", "inseparable", "unexplained", "no_gap"]


@pytest.mark.parametrize("generator", [PLAIN, "reality", "wake"])
def test_plans_hold_what_is_asked_in_an_order_that_tells_nothing(generator: str) -> None:
    planned = plan_plain if generator == PLAIN else partial(plan_pairs, generator)
    plans = planned(3, 6, 20)
    assert [plan.name[1:] for plan in plans] == [f"{n:03d}" for n in range(26)]
    assert sum(plan.change is None for plan in plans) == 6
    assert not all(plan.change is None for plan in plans[:6])
    assert max(Counter(plan.change for plan in plans if plan.change).values()) == 1  # each in turn
    makeable = set(CHANGES) if generator == PLAIN else set(catalogue()) & set(GENERATORS[generator].mechanisms)
    assert {plan.change for plan in plans} - {None} <= makeable
    assert len({plan.seed for plan in plans}) == 26
    assert plans == planned(3, 6, 20)
    assert plans != planned(4, 6, 20)


def test_what_has_an_answer_is_not_made_again(tmp_path: Path) -> None:
    plans = plan_changes((0, 1), "m", 1, ("a",), 2)
    ChangeAnswer(plans[1].name, PLAIN, None, (), 0.0, 0).write(tmp_path)
    assert missing(tmp_path, plans) == [plans[0], plans[2]]


def case(
    change: str | None, verdict: Verdict, named: str = "", *, right: str = "", generator: str = "reality", **p: float
) -> ChangeCase:
    answer = ChangeAnswer("p000", generator, change, (right,) if right else (), 1.0, 0)
    return ChangeCase(answer, Diagnosis(verdict, ((named, "other"),) if named else (), p))


SLACK = {"change": "slack", "right": "tendon_slack"}


@pytest.mark.parametrize(
    ("told", "right"),
    [
        (case(None, "no_gap"), True),
        (case(None, "unexplained"), False),
        (case(**SLACK, verdict="named", named="tendon_slack", tendon_slack=0.95), True),  # type: ignore[arg-type]
        (case(**SLACK, verdict="named", named="tendon_friction", tendon_friction=0.7), False),  # type: ignore[arg-type]
        (case(**SLACK, verdict="unexplained"), False),  # type: ignore[arg-type]
        (case("gust", "unexplained"), True),
        (case("gust", "named", "wave_drag", wave_drag=0.6), False),
    ],
)
def test_what_is_right(told: ChangeCase, right: bool) -> None:
    assert told.right == right


def test_scores_of_pairs_count_alarms_names_and_what_is_sure_and_wrong() -> None:
    slack = partial(case, "tendon_slack", right="tendon_slack")
    cases = [
        case(None, "no_gap", wave_drag=0.1),
        case(None, "named", "wave_drag", wave_drag=0.95),
        slack("named", "tendon_slack", tendon_slack=0.99),
        slack("named", "tendon_friction", tendon_friction=0.6, tendon_slack=0.3),
        slack("no_gap", tendon_slack=0.2),
    ]
    rows = {row[0]: row[-1] for row in scores_of(cases, "a command").tables[0].rows}
    assert rows["healthy pairs: false alarms"].startswith("1 of 2")
    assert rows["changed, any d: named first"].startswith("1 of 3")
    assert rows["wrong and sure (above 0.9)"].startswith("1 of 5")


def test_scores_of_plain_sessions_count_what_is_right() -> None:
    cases = [
        case("slack", "named", "tendon_slack", right="tendon_slack", generator=PLAIN, tendon_slack=0.95),
        case("gust", "named", "wave_drag", generator=PLAIN, wave_drag=0.95),
    ]
    rows = {row[0]: row[-1] for row in scores_of(cases, "a command").tables[0].rows}
    assert rows["all sessions: right"].startswith("1 of 2")
    assert rows["wrong and sure (above 0.9)"].startswith("1 of 2")
