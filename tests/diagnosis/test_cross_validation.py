"""Names are withdrawn where fitted trials, left out in turn, speak against them, and only there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.evidence import Hypotheses
from diagnosis.held_out import SkillScore
from diagnosis.hypotheses import Hypothesis, Probabilities
from diagnosis.linear_model import LinearModel
from diagnosis.refit import Refit, refit_from
from diagnosis.result import GapSize
from diagnosis.verdict import Validated, Verdict, left_out, refutable, validated, without_refuted
from swimcal.effects.catalogue import catalogue
from tests.diagnosis.linear_models import linear
from tests.diagnosis.rows import DIRECTIONS, K, hypotheses, made, signature

WORSE = (-1.6, -0.1)


def refitted(*names: str) -> Refit:
    size = 5 + len(names)
    effects = tuple(map(made, names))
    return Refit(effects, np.ones(5), np.zeros(len(names)), np.zeros(K), np.eye(size), np.ones(size), np.eye(K, size))


@pytest.fixture(scope="module")
def weighed() -> Hypotheses:
    """Of two effects; the second changes but the last number of the row, which holds a frequency."""
    made = [signature("slack", DIRECTIONS[0]), signature("gear", np.eye(K)[K - 1])]
    found = hypotheses(9 * DIRECTIONS[0] + 9 * np.eye(K)[K - 1], made)
    return replace(found, not_features=slice(K - 1, K))


@pytest.mark.parametrize(
    ("names", "interval", "against"),
    [
        (("slack",), WORSE, ("slack",)),
        (("slack", "gear"), WORSE, ("slack",)),
        (("slack",), (-1.6, 0.05), ()),
        (("slack",), None, ()),
        (("gear",), WORSE, ()),
    ],
)
def test_only_what_makes_forecasts_of_features_surely_worse_is_refuted(
    weighed: Hypotheses, names: tuple[str, ...], interval: tuple[float, float] | None, against: tuple[str, ...]
) -> None:
    told = SkillScore(2.0, 3.0, None if interval is None else sum(interval) / 2, interval)
    assert refutable(told, refitted(*names), weighed) == against


@pytest.mark.long
def test_two_fitted_trials_say_nothing(weighed: Hypotheses) -> None:
    before = Validated(Verdict("named", (("slack",),)), Probabilities(("slack",), {}), refitted("slack"))
    assert validated(before, linear(), weighed, lambda names: refitted(*names), 0) is before


def test_a_trial_left_out_has_no_part_in_its_own_forecast() -> None:
    """Where its own residual changes, that of its forecast changes by just as much, and no less."""
    found = refit_from(linear(), [catalogue()["bend_offset"]], np.zeros(1), rounds=1)
    row = np.array(found.residual)
    first = linear().trial_of == 0
    row[first] += np.sqrt(np.diag(linear().covariance))[first]
    moved = replace(found, residual=row)
    fixed: LinearModel = replace(linear())
    fixed.__dict__["covariance_with_gap_in"] = lambda _left: linear().covariance
    change = left_out(fixed, moved) - left_out(fixed, found)
    expected = fixed.whitened_swims(moved.residual) - fixed.whitened_swims(found.residual)
    own = fixed.trial_of[fixed.scored] == 0
    np.testing.assert_allclose(change[own], expected[own], atol=1e-6)


def test_what_is_refuted_is_not_there_and_all_else_as_before() -> None:
    unknown = Hypothesis((), True)
    sets = {Hypothesis(()): 0.1, Hypothesis((0,)): 0.5, Hypothesis((0, 1)): 0.1, unknown: 0.2, Hypothesis((1,)): 0.1}
    found = Probabilities(("a", "b"), sets).refuted("a")
    assert found.marginal == pytest.approx([0.0, 0.2])
    assert found.null == pytest.approx(0.1 + 0.5 / 3)
    assert found.of[unknown] == pytest.approx(0.2 + 1.0 / 3)
    assert found.of[Hypothesis((1,))] == pytest.approx(0.2)
    assert sum(found.of.values()) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("groups", "stays"), [((("slack",),), ()), ((("slack",), ("gear",)), ("gear",)), ((("gear",),), ("gear",))]
)
def test_what_held_out_swims_refute_is_withdrawn_but_not_what_changes_frequencies(
    weighed: Hypotheses, groups: tuple[tuple[str, ...], ...], stays: tuple[str, ...]
) -> None:
    chances = Probabilities(("slack", "gear"), {Hypothesis((0, 1)): 0.97, Hypothesis((1,)): 0.03})
    before = Validated(Verdict("named", groups), chances, refitted(*(group[0] for group in groups)))
    found = without_refuted(before, GapSize(2.2, 4.2, grows=True), weighed, lambda names: refitted(*names))
    assert found.verdict.effects == stays
    assert found.verdict.name == ("named" if stays else "unexplained")
    assert (() if found.best is None else tuple(effect.name for effect in found.best.effects)) == stays
    withdrawn = [(each.effects, each.held_out_mm) for each in found.refutations]
    assert withdrawn == ([] if groups == (("gear",),) else [(("slack",), (2.2, 4.2))])
