"""Pairs of sessions: their plans, and the scores of what is said of them."""

from __future__ import annotations

from collections import Counter
from typing import Literal

import pytest

from benchmarks.effects.generators import GENERATORS
from benchmarks.effects.pair_scoring import PairCase, scores_of
from benchmarks.effects.pairs import PairAnswer, plan_pairs
from benchmarks.effects.scored_diagnosis import Diagnosis
from swimcal.effects.catalogue import catalogue

Verdict = Literal["named", "inseparable", "unexplained", "no_gap"]


@pytest.mark.parametrize("generator", ["reality", "wake"])
def test_plans_hold_what_is_asked_in_an_order_that_tells_nothing(generator: str) -> None:
    plans = plan_pairs(generator, 3, 6, 20)  # type: ignore[arg-type]
    assert [plan.name for plan in plans] == [f"p{n:03d}" for n in range(26)]
    assert sum(plan.effect is None for plan in plans) == 6
    assert not all(plan.effect is None for plan in plans[:6])
    assert max(Counter(plan.effect for plan in plans if plan.effect).values()) == 1  # each effect in turn
    assert {plan.effect for plan in plans} - {None} <= set(catalogue()) & set(GENERATORS[generator].mechanisms)
    assert len({plan.seed for plan in plans}) == 26
    assert plans == plan_pairs(generator, 3, 6, 20)  # type: ignore[arg-type]
    assert plans != plan_pairs(generator, 4, 6, 20)  # type: ignore[arg-type]


def case(effect: str | None, d: float, verdict: Verdict, named: str = "", **chances: float) -> PairCase:
    answer = PairAnswer("p000", "reality", effect, 1.0, 0)
    return PairCase(answer, d, Diagnosis(verdict, ((named,),) if named else (), chances))


def test_scores_count_alarms_names_and_what_is_sure_and_wrong() -> None:
    cases = [
        case(None, 0.0, "no_gap", wave_drag=0.1),
        case(None, 0.0, "named", "wave_drag", wave_drag=0.95),
        case("tendon_slack", 9.0, "named", "tendon_slack", tendon_slack=0.99),
        case("tendon_slack", 8.0, "named", "tendon_friction", tendon_friction=0.6, tendon_slack=0.3),
        case("tendon_slack", 1.0, "no_gap", tendon_slack=0.2),
    ]
    rows = {row[0]: row[-1] for row in scores_of(cases, "a command").tables[0].rows}
    assert rows["healthy pairs: false alarms"].startswith("1 of 2")
    assert rows["changed, d >= 4: named first"].startswith("1 of 2")
    assert rows["changed, any d: named first"].startswith("1 of 3")
    assert rows["wrong and sure (above 0.9)"].startswith("1 of 5")
