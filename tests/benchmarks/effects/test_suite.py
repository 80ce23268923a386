"""What a suite holds, and that nothing but its tracks tells what is in a session."""

from collections import Counter

import numpy as np
import pytest
from sklearn.ensemble import RandomForestClassifier
from sklearn.model_selection import cross_val_score

from benchmarks.effects.suite import APART_HZ, DETECTABILITIES, SIZES, SessionPlan, plan_suite

CATALOGUED = tuple(f"effect_{i}" for i in range(33))
OUTSIDE = tuple(f"other_{i}" for i in range(8))


@pytest.fixture(scope="module")
def large() -> tuple[SessionPlan, ...]:
    return plan_suite(1, SIZES["large"], CATALOGUED, OUTSIDE)


def test_a_large_suite_has_the_shares_that_are_asked(large: tuple[SessionPlan, ...]) -> None:
    assert Counter(plan.kind for plan in large) == {"null": 300, "single": 240, "double": 80, "outside": 80}


def test_every_effect_and_every_detectability_comes_about_equally_often(large: tuple[SessionPlan, ...]) -> None:
    singles = Counter(plan.effects[0] for plan in large if plan.kind == "single")
    assert set(singles) == set(CATALOGUED)
    assert max(singles.values()) - min(singles.values()) <= 1
    outside = Counter(plan.effects[0] for plan in large if plan.kind == "outside")
    assert set(outside.values()) == {10}
    levels = Counter(plan.detectability for plan in large if plan.kind != "null")
    assert levels == dict.fromkeys(DETECTABILITIES, 80)
    assert all(plan.detectability == 0 and not plan.effects for plan in large if plan.kind == "null")


def test_the_two_of_a_double_differ(large: tuple[SessionPlan, ...]) -> None:
    assert all(len(set(plan.effects)) == 2 for plan in large if plan.kind == "double")


def test_every_session_can_be_fitted_and_scored(large: tuple[SessionPlan, ...]) -> None:
    for plan in large:
        recorded = plan.recorded
        assert len(recorded.fit_hz) >= 2
        assert len(recorded.holdout_hz) >= 2
        assert np.diff(sorted((*recorded.fit_hz, *recorded.holdout_hz))).min() >= APART_HZ - 1e-9


def test_a_seed_gives_the_same_suite_again_and_another_seed_another() -> None:
    one, again, other = (plan_suite(seed, SIZES["small"], CATALOGUED, OUTSIDE) for seed in (3, 3, 4))
    assert one == again
    assert len(one) == 24
    assert {plan.name for plan in one}.isdisjoint(plan.name for plan in other)


def test_names_order_and_what_was_recorded_do_not_tell_what_is_present(large: tuple[SessionPlan, ...]) -> None:
    """A classifier of everything but the tracks is at chance: it cannot tell null from the rest."""
    reported = np.array([_metadata(number, plan) for number, plan in enumerate(large)])
    null = np.array([plan.kind == "null" for plan in large])
    forest = RandomForestClassifier(60, min_samples_leaf=5, random_state=0)
    area = cross_val_score(forest, reported, null, cv=5, scoring="roc_auc").mean()
    assert abs(area - 0.5) < 0.07


def _metadata(number: int, plan: SessionPlan) -> list[float]:
    recorded = plan.recorded
    return [
        number,
        int(plan.name[1:], 16),
        plan.seed,
        len(recorded.fit_hz),
        len(recorded.holdout_hz),
        min(recorded.fit_hz),
        max(recorded.fit_hz),
        recorded.seconds,
        recorded.dry_hz or 0.0,
        recorded.free_decay,
        recorded.logged,
    ]
