"""Scores of made-up diagnoses, counted by hand."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from benchmarks.effects.folder import Answer
from benchmarks.effects.score import (
    Case,
    Measures,
    calibration_error,
    error_by_chance,
    measures,
    of_kind,
    reachable,
)
from benchmarks.effects.scored_diagnosis import Diagnosis, Gap, Where
from benchmarks.scores import Estimate

NULL = Answer("n", "null")
SLACK = Answer("s", "single", ("tendon_slack",), None, (("tendon_friction",),), 5.0, "tail", 0.8)
WEAK = Answer("w", "single", ("scale_error",), None, ((),), 2.0, "camera", 0.4)
BOTH = Answer("b", "double", ("tendon_slack", "scale_error"), None, ((), ()), 5.0, None, 0.9)
TETHER = Answer("t", "outside", outside="tether", detectability=10.0, stage="body")


def made(
    verdict: Any, *groups: tuple[str, ...], shrinkage: float | None = None, stage: str = "tail", **p: float
) -> Diagnosis:
    gap = None if shrinkage is None else Gap(shrinkage, (shrinkage - 0.1, shrinkage + 0.1))
    return Diagnosis(verdict, groups, {"none_of_these": 0.0, **p}, Where({stage: 0.6, "floor": 0.4}), gap, seconds=10.0)


def measured(*cases: tuple[Answer, Diagnosis]) -> Measures:
    return measures([Case(answer, found) for answer, found in cases])


def counted(found: Measures, *names: str) -> list[tuple[int, int]]:
    return [tuple(found[name].found) for name in names]  # type: ignore[misc]


def value(found: Measures, name: str) -> float:
    return found[name].found.value


def test_a_false_alarm_is_whatever_is_not_no_gap() -> None:
    quiet, named, unexplained = (
        made("no_gap"),
        made("named", ("scale_error",), scale_error=0.6),
        made("unexplained"),
    )
    found = measured((NULL, quiet), (NULL, named), (NULL, unexplained), (NULL, quiet))
    assert counted(found, "false_alarms", "right_first") == [(2, 4), (0, 0)]


def test_the_right_name_counts_first_and_in_a_set_where_it_is_clear() -> None:
    first = made("inseparable", ("tendon_slack", "tendon_friction"), tendon_slack=0.6, tendon_friction=0.3)
    second = made("inseparable", ("tendon_slack", "tendon_friction"), tendon_slack=0.3, tendon_friction=0.6)
    wrong = made("named", ("tendon_friction",), tendon_friction=0.95)
    wide = made("named", ("tendon_slack", "a", "b"), ("c",), tendon_slack=0.9)  # a set of four is no answer
    found = measured((SLACK, first), (SLACK, second), (SLACK, wrong), (SLACK, wide), (WEAK, made("no_gap")))
    assert counted(found, "right_first", "right_in_three", "confident_wrong") == [(2, 4), (2, 4), (1, 5)]
    assert counted(found, "first_at_2", "first_at_5", "first_at_10") == [(0, 1), (2, 4), (0, 0)]


def test_every_group_that_is_named_is_right_or_wrong() -> None:
    either = made("inseparable", ("tendon_friction", "tendon_slack"), ("wave_drag",))
    alone, nothing = made("named", ("scale_error",)), made("unexplained")
    found = measured((SLACK, either), (NULL, alone), (BOTH, alone), (SLACK, nothing))
    assert counted(found, "groups_right", "only_wrong") == [(2, 4), (1, 4)]


def test_what_is_clear_is_counted_apart_next_to_what_can_be_reached() -> None:
    """At d = 10 a matched filter sees it, at the threshold for one false alarm in a hundred one of two."""
    faint = replace(TETHER, detectability=2.326)
    cases = [(TETHER, made("unexplained")), *((answer, made("no_gap")) for answer in (faint, BOTH, NULL))]
    found = measured(*cases)
    assert counted(found, "unexplained_clear", "unexplained_outside", "doubles_clear") == [(1, 1), (1, 2), (0, 1)]
    both = [Case(answer, found) for answer, found in cases]
    assert reachable(both, of_kind("outside")) == pytest.approx(0.75, abs=1e-3)
    assert np.isnan(reachable(both, of_kind("single")))


def test_both_of_two_must_be_in_groups_of_their_own() -> None:
    right = made("named", ("tendon_slack", "tendon_friction"), ("scale_error",), tendon_slack=0.9, scale_error=0.9)
    as_alternatives = made("inseparable", ("tendon_slack", "scale_error"), tendon_slack=0.5, scale_error=0.5)
    one = made("named", ("tendon_slack",), tendon_slack=0.99)
    beside = made("inseparable", ("tendon_slack", "scale_error"), ("wave_drag",), tendon_slack=0.5, scale_error=0.5)
    whatever = made("named", ("tendon_slack",), ("scale_error",), ("wave_drag",), ("bend_offset",), tendon_slack=0.9)
    found = measured(*((BOTH, each) for each in (right, as_alternatives, one, beside, whatever)))
    assert counted(found, "doubles_in_groups") == [(1, 5)]


def test_outside_the_catalogue_a_sure_name_is_worse_than_a_guess() -> None:
    sure, guess = (made("named", ("wave_drag",), wave_drag=p) for p in (0.95, 0.6))
    found = measured((TETHER, made("unexplained")), (TETHER, sure), (TETHER, guess))
    assert counted(found, "unexplained_outside", "confident_outside") == [(1, 3), (1, 3)]


def test_intervals_and_stages_count_where_they_can_be_right() -> None:
    right = made("named", ("tendon_slack",), tendon_slack=0.99, shrinkage=0.75)
    off = made("named", ("tendon_slack",), tendon_slack=0.99, shrinkage=0.5, stage="camera")
    found = measured((SLACK, right), (SLACK, off), (WEAK, made("unexplained", shrinkage=0.4)), (NULL, made("no_gap")))
    assert counted(found, "stage_right", "interval_holds") == [(1, 3), (1, 2)]
    elsewhere = replace(off, where=Where({"tail": 0.1, "body": 0.8}))
    assert counted(measured((SLACK, elsewhere)), "stage_right") == [(0, 1)]


def test_what_weak_effects_shrink_by_is_not_held_against_the_oracle() -> None:
    clear, weak = (
        made("named", (name,), shrinkage=shrinkage) for name, shrinkage in (("tendon_slack", 0.6), ("scale_error", 4.0))
    )
    no_form = replace(SLACK, oracle_shrinkage=-6.0)
    for others in ((WEAK, weak), (no_form, clear)):
        assert value(measured((SLACK, clear), others, others), "shrinkage") == pytest.approx(0.75)
    assert np.isnan(value(measured((WEAK, weak)), "shrinkage"))


def test_probabilities_that_come_true_as_often_as_they_say_have_no_error() -> None:
    random = np.random.default_rng(0)
    p = random.uniform(0, 1, 40_000)
    assert calibration_error(p, random.uniform(0, 1, len(p)) < p) < 0.01
    sure = calibration_error(p, random.uniform(0, 1, len(p)) < p**2)
    assert sure == pytest.approx(1 / 6, abs=0.01)  # mean of p - p^2
    assert np.isnan(calibration_error(np.zeros(0), np.zeros(0)))


def test_a_few_probabilities_err_by_chance_and_many_do_not() -> None:
    """Of one at a half the error is a half, whatever comes."""
    assert error_by_chance(np.array([0.5])).value == pytest.approx(0.5)
    chance, (low, high) = error_by_chance(np.random.default_rng(1).uniform(size=4000))
    assert low < chance < high < 0.03
    assert np.isnan(error_by_chance(np.zeros(0)).value)


def test_small_probabilities_do_not_water_the_error_down() -> None:
    """Those below 1 % do not count; of those from 10 % on, where somebody looks, there is one, and it is wrong."""
    half = made("named", ("tendon_slack",), tendon_slack=0.5, **{f"e{i}": 0.001 for i in range(30)})
    assert value(measured((SLACK, half)), "calibration") == pytest.approx(0.5)
    small = {f"e{i}": 0.015 for i in range(30)}
    quiet, loud = (Diagnosis("no_gap", (), small | more) for more in ({}, {"e0": 0.8}))
    found = measured(*[(SLACK, quiet)] * 5, (SLACK, loud))
    error = found["calibration"].found
    assert isinstance(error, Estimate)
    assert error.interval[0] <= error.value <= error.interval[1] < 0.15
    assert error.value < 0.05
    assert value(found, "of_suspects") == pytest.approx(0.8)
