"""Scores of made-up diagnoses, counted by hand."""

import json
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.effects.answer import Answer
from benchmarks.effects.followed import FollowedScore
from benchmarks.effects.score import Score, scored
from benchmarks.effects.scoring import Outcome
from benchmarks.effects.shares import Reliability, Share, median
from benchmarks.effects.told import Told
from benchmarks.effects.without import WithoutScore

NULL = Answer("n", "null")
SLACK = Answer("s", "single", ("tendon_slack",), None, (("tendon_friction",),), 5.0, "tail", 0.8)
WEAK = Answer("w", "single", ("scale_error",), None, ((),), 2.0, "camera", 0.4)
BOTH = Answer("b", "double", ("tendon_slack", "scale_error"), None, ((), ()), 5.0, None, 0.9)
TETHER = Answer("t", "outside", outside="tether", detectability=10.0, stage="body")
CERTAIN = {"sessions", "missing", "hits", "of", "confusion", "named_instead", "look_alikes", "reachable", "told"}
"""Counts; what was told; what a matched filter would see of these very sessions."""


def told(
    verdict: str, *groups: tuple[str, ...], shrinkage: float | None = None, stage: str = "tail", **p: float
) -> Told:
    interval = None if shrinkage is None else (shrinkage - 0.1, shrinkage + 0.1)
    return Told(verdict, groups, {"none_of_these": 0.0, **p}, {stage: 0.6, "floor": 0.4}, shrinkage, interval, 10.0)


def headline(*cases: tuple[Answer, Told]) -> dict[str, tuple[int, int]]:
    answers, diagnoses = zip(*cases, strict=True)
    return {name: (share.hits, share.of) for name, share in scored(answers, diagnoses).headline.items()}


def test_a_false_alarm_is_whatever_is_not_no_gap() -> None:
    quiet, named, unexplained = told("no_gap"), told("named", ("scale_error",), scale_error=0.6), told("unexplained")
    counted = headline((NULL, quiet), (NULL, named), (NULL, unexplained), (NULL, quiet))
    assert counted["false_alarms"] == (2, 4)
    assert counted["right_first"] == (0, 0)


def test_the_right_name_counts_first_and_in_a_set_where_it_is_clear() -> None:
    first = told("inseparable", ("tendon_slack", "tendon_friction"), tendon_slack=0.6, tendon_friction=0.3)
    second = told("inseparable", ("tendon_slack", "tendon_friction"), tendon_slack=0.3, tendon_friction=0.6)
    wrong = told("named", ("tendon_friction",), tendon_friction=0.95)
    counted = headline((SLACK, first), (SLACK, second), (SLACK, wrong), (WEAK, told("no_gap")))
    assert counted["right_first"] == (1, 3)
    assert counted["right_in_three"] == (2, 3)
    assert counted["confident_wrong"] == (1, 4)


def test_every_group_that_is_said_is_right_or_wrong() -> None:
    either = told("inseparable", ("tendon_friction", "tendon_slack"), ("wave_drag",))
    alone, nothing = told("named", ("scale_error",)), told("unexplained")
    answers, diagnoses = (SLACK, NULL, BOTH, SLACK), (either, alone, alone, nothing)
    assert scored(answers, diagnoses).said_right == (2, 4)


def test_a_set_of_four_is_no_answer() -> None:
    wide = told("named", ("tendon_slack", "a", "b"), ("c",), tendon_slack=0.9)
    assert headline((SLACK, wide))["right_in_three"] == (0, 1)


def test_what_is_clear_is_counted_apart_beside_what_can_be_reached_at_all() -> None:
    """At d = 10 a matched filter sees it, at the threshold for one false alarm in a hundred one of two."""
    faint = replace(TETHER, detectability=2.326)
    score = scored([TETHER, faint, BOTH, NULL], [told("unexplained"), *[told("no_gap")] * 3])
    assert tuple(score.clear_alone["unexplained_outside"]) == (1, 1)
    assert score.headline["unexplained_outside"].of == 2
    assert tuple(score.clear_alone["doubles_in_groups"]) == (0, 1)
    assert score.reachable["unexplained_outside"] == pytest.approx(0.75, abs=1e-3)
    assert np.isnan(scored([NULL], [told("no_gap")]).reachable["stage_right"])


def test_both_of_two_must_be_in_groups_of_their_own() -> None:
    right = told("named", ("tendon_slack", "tendon_friction"), ("scale_error",), tendon_slack=0.9, scale_error=0.9)
    as_alternatives = told("inseparable", ("tendon_slack", "scale_error"), tendon_slack=0.5, scale_error=0.5)
    one = told("named", ("tendon_slack",), tendon_slack=0.99)
    beside = told("inseparable", ("tendon_slack", "scale_error"), ("wave_drag",), tendon_slack=0.5, scale_error=0.5)
    whatever = told("named", ("tendon_slack",), ("scale_error",), ("wave_drag",), ("bend_offset",), tendon_slack=0.9)
    cases = [(BOTH, each) for each in (right, as_alternatives, one, beside, whatever)]
    assert headline(*cases)["doubles_in_groups"] == (1, 5)


def test_outside_the_catalogue_unexplained_is_right_and_a_sure_name_is_worse_than_a_guess() -> None:
    counted = headline(
        (TETHER, told("unexplained")),
        (TETHER, told("named", ("wave_drag",), wave_drag=0.95)),
        (TETHER, told("named", ("wave_drag",), wave_drag=0.6)),
    )
    assert counted["unexplained_outside"] == (1, 3)
    assert counted["confident_outside"] == (1, 3)
    assert counted["confident_wrong"] == (1, 3)


def test_the_stage_and_the_interval() -> None:
    right = told("named", ("tendon_slack",), tendon_slack=0.99, shrinkage=0.75)
    off = told("named", ("tendon_slack",), tendon_slack=0.99, shrinkage=0.5, stage="camera")
    counted = headline((SLACK, right), (SLACK, off), (WEAK, told("unexplained", shrinkage=0.4)), (NULL, told("no_gap")))
    assert counted["stage_right"] == (1, 3)
    assert counted["interval_holds"] == (1, 2)


def score(*cases: tuple[Answer, Told]) -> Score:
    answers, diagnoses = zip(*cases, strict=True)
    return scored(answers, diagnoses)


def test_tables_by_detectability_by_effect_and_of_confusion() -> None:
    right = told("named", ("tendon_slack",), tendon_slack=0.99, shrinkage=0.6)
    wrong = told("named", ("tendon_friction",), tendon_friction=0.7)
    found = score((SLACK, right), (SLACK, wrong), (SLACK, told("unexplained")), (WEAK, told("no_gap")))
    assert {level: (s.hits, s.of) for level, s in found.by_detectability.items()} == {2.0: (0, 1), 5.0: (1, 3)}
    assert found.by_effect == {"tendon_slack": Share(1, 3)}
    assert found.confusion == {"tendon_slack": {"tendon_slack": 1, "tendon_friction": 1, "(none)": 1}}
    assert found.in_three_by_detectability == {2.0: Share(0, 1), 5.0: Share(1, 3)}
    assert found.in_three_by_effect == {"tendon_slack": Share(1, 3)}
    assert found.shrinkage_of_oracle.value == pytest.approx(0.75)
    assert found.seconds.value == 10.0


def test_what_weak_effects_shrink_by_is_not_held_against_the_oracle() -> None:
    clear, weak = (
        told("named", (name,), shrinkage=shrinkage) for name, shrinkage in (("tendon_slack", 0.6), ("scale_error", 4.0))
    )
    assert score((SLACK, clear), (WEAK, weak), (WEAK, weak)).shrinkage_of_oracle.value == pytest.approx(0.75)
    assert np.isnan(score((WEAK, weak)).shrinkage_of_oracle.value)
    no_form = replace(SLACK, oracle_shrinkage=-6.0)
    assert score((SLACK, clear), (no_form, clear), (no_form, clear)).shrinkage_of_oracle.value == pytest.approx(0.75)


def test_probabilities_that_come_true_as_often_as_they_say_have_no_error() -> None:
    random = np.random.default_rng(0)
    p = random.uniform(0, 1, 40_000)
    fair, sure = (
        Reliability.of(p, random.uniform(0, 1, len(p)) < p),
        Reliability.of(p, random.uniform(0, 1, len(p)) < p**2),
    )
    assert fair.error < 0.01
    assert sure.error == pytest.approx(1 / 6, abs=0.01)  # mean of p - p^2
    assert sum(share.of for share in sure.true) == len(p)


def test_a_few_probabilities_err_by_chance_and_many_do_not() -> None:
    """Of one at a half the error is a half, whatever comes."""
    assert Reliability.error_by_chance(np.array([0.5])).value == pytest.approx(0.5)
    value, (low, high) = Reliability.error_by_chance(np.random.default_rng(1).uniform(size=4000))
    assert low < value < high < 0.03
    assert np.isnan(Reliability.error_by_chance(np.zeros(0)).value)


def test_small_probabilities_do_not_water_the_error_down() -> None:
    found = score((SLACK, told("named", ("tendon_slack",), tendon_slack=0.5, **{f"e{i}": 0.001 for i in range(30)})))
    assert found.reliability.true == (Share(1, 1),)
    assert found.reliability.error == pytest.approx(0.5)


def test_whoever_tells_small_probabilities_alone_errs_by_little_but_not_where_somebody_looks() -> None:
    """Seen from 1 % on; of those from 10 % on there is one, and it is wrong."""
    small = {f"e{i}": 0.015 for i in range(30)}
    quiet = Told("no_gap", (), small, {}, None, None, None)
    found = score(*[(SLACK, quiet)] * 5, (SLACK, replace(quiet, probabilities=small | {"e0": 0.8})))
    assert found.calibration_error.value < 0.05
    assert found.calibration_error_of_suspects.value == pytest.approx(0.8)
    low, high = found.calibration_error.interval
    assert low <= found.calibration_error.value <= high


def test_intervals_by_resampling_hold_the_truth_about_as_often_as_they_say() -> None:
    random = np.random.default_rng(2)
    found = [median(list(random.normal(0.8, 0.2, 30))).interval for _ in range(150)]
    assert 0.88 <= np.mean([low <= 0.8 <= high for low, high in found]) <= 1.0
    assert np.isnan(median([0.5]).interval).all()  # too little for one
    assert np.isnan(median([]).value)


def test_a_share_has_wilsons_interval() -> None:
    assert Share(0, 300).interval == pytest.approx((0.0, 0.01264), abs=1e-4)
    assert np.isnan(Share(0, 0).value)


def test_rivals_that_cannot_be_told_apart_are_counted_unless_the_effect_is_just_weak() -> None:
    weak = Answer("v", "single", ("wave_drag",), None, (tuple(f"e{i}" for i in range(30)),), 1.0, "body", 0.2)
    found = score((SLACK, told("no_gap")), (SLACK, told("no_gap")), (weak, told("no_gap")), (BOTH, told("no_gap")))
    assert found.look_alikes == {"tendon_slack": {"tendon_friction": 2}}


def without_interval(told: object, path: tuple[str, ...] = ()) -> list[str]:
    """Places of all numbers that neither stand beside their interval nor are listed as certain of these sessions."""
    if isinstance(told, dict):
        of_estimate = {"share", "value", "ci95"} if "ci95" in told else set()
        inner = [(name, each) for name, each in told.items() if name not in of_estimate]
    elif isinstance(told, list | tuple):
        inner = [("-", each) for each in told]
    else:
        certain = isinstance(told, str) or bool(CERTAIN & set(path))
        return [] if told is None or certain else ["/".join(path)]
    return [place for name, each in inner for place in without_interval(each, (*path, name))]


def intervals(told: object) -> list[tuple[float, tuple[float, float]]]:
    """All numbers that stand beside an interval."""
    if not isinstance(told, dict | list | tuple):
        return []
    found = [pair for each in (told.values() if isinstance(told, dict) else told) for pair in intervals(each)]
    if isinstance(told, dict) and "ci95" in told:
        found.append((told["share" if "share" in told else "value"], told["ci95"]))
    return found


def test_every_estimate_stands_with_its_interval() -> None:
    right = told("named", ("tendon_slack",), tendon_slack=0.99, wave_drag=0.15, shrinkage=0.75)
    wrong = told("inseparable", ("tendon_slack", "wave_drag"), tendon_slack=0.3, wave_drag=0.6, shrinkage=0.2)
    outside, quiet = told("unexplained", shrinkage=0.4, stage="body"), told("no_gap", scale_error=0.04)
    cases = [(SLACK, right), (SLACK, wrong), (WEAK, quiet), (BOTH, wrong), (TETHER, outside), (NULL, quiet)] * 6
    found = score(*cases)
    followed = FollowedScore(("tendon_slack", "wave_drag"), (right, wrong))
    plain = Outcome({"diagnosis": found}, WithoutScore(found), followed).to_json()
    assert without_interval(plain) == []
    each = intervals(plain)
    assert len(each) > 30
    assert all(low <= value <= high for value, (low, high) in each)
    assert without_interval({"seconds": 10.0, "bins": [{"told": 0.1, "true": 0.2}]}) == ["seconds", "bins/-/true"]
    assert without_interval({"seconds": {"value": 10.0}}) == ["seconds/value"]


def test_it_is_plain_json() -> None:
    json.dumps(score((NULL, told("no_gap")), (SLACK, told("unexplained")), (TETHER, told("unexplained"))).to_json())
