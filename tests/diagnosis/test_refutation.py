"""Names are taken back where held-out swims speak against them, and only there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.evidence import Explanations
from diagnosis.gap import Shrinkage
from diagnosis.held_out import Gap
from diagnosis.probabilities import Explanation, Probabilities
from diagnosis.refit import Refit
from diagnosis.refutation import Refutation, Stood, refutable, stood
from diagnosis.verdict import Verdict, VerdictName
from tests.diagnosis.rows import DIRECTIONS, K, explanations, made, signature

WORSE = (-1.6, -0.1)


def gap(value: float | None, interval: tuple[float, float] | None) -> Gap:
    return Gap(Shrinkage(2.0, 3.0, value, interval), (), (), 1e-3, None)


def refitted(*names: str) -> Refit:
    size = 5 + len(names)
    return Refit(tuple(map(made, names)), np.ones(5), np.zeros(len(names)), np.zeros(K), np.eye(size), np.ones(size))


@pytest.fixture(scope="module")
def weighed() -> Explanations:
    """Of two effects; the second changes but the last number of the row, which holds a frequency."""
    made = [signature("slack", DIRECTIONS[0]), signature("gear", np.eye(K)[K - 1])]
    found = explanations(9 * DIRECTIONS[0] + 9 * np.eye(K)[K - 1], made)
    return replace(found, numbers=slice(K - 1, K))


@pytest.mark.parametrize(
    ("names", "interval", "against"),
    [
        (("slack",), WORSE, ("slack",)),
        (("slack", "gear"), WORSE, ("slack",)),
        (("slack",), (-1.6, 0.05), ()),
        (("slack",), (0.5, 0.9), ()),
        (("slack",), None, ()),
        (("gear",), WORSE, ()),
    ],
)
def test_only_what_makes_forecasts_of_gaits_surely_worse_is_refuted(
    weighed: Explanations, names: tuple[str, ...], interval: tuple[float, float] | None, against: tuple[str, ...]
) -> None:
    told = gap(None if interval is None else sum(interval) / 2, interval).shrinkage
    assert refutable(told, refitted(*names), weighed) == against


def test_what_is_left_of_a_verdict_has_a_twin_and_a_gap(weighed: Explanations) -> None:
    """The less likely name goes first; with the other alone held-out swims are forecast better."""
    sets = {Explanation((0, 1)): 0.7, Explanation((1,)): 0.3}
    before = Stood(
        Verdict("named", (("gear",), ("slack",))),
        Probabilities(("slack", "gear"), sets),
        refitted("gear", "slack"),
        gap(-0.8, WORSE),
        (),
    )
    found = stood(before, weighed, lambda names: refitted(*names), lambda twin: gap(0.5, (0.1, 0.9)) if twin else None)
    assert found.verdict == Verdict("named", (("gear",),))
    assert found.best is not None
    assert [effect.name for effect in found.best.effects] == ["gear"]
    assert found.gap is not None
    assert found.gap.shrinkage.value == 0.5
    assert found.refutations == (Refutation("slack", -0.8, WORSE),)
    assert found.probabilities.marginal == pytest.approx([0.0, 1.0])


LIKE_A = Explanation((), True, 0)


def test_what_is_refuted_is_not_there_and_all_else_as_before() -> None:
    sets = {Explanation(()): 0.1, Explanation((0,)): 0.5, Explanation((0, 1)): 0.1, LIKE_A: 0.2, Explanation((1,)): 0.1}
    found = Probabilities(("a", "b"), sets).refuted("a")
    assert found.marginal == pytest.approx([0.0, 0.2])
    assert found.null == pytest.approx(0.1 + 0.5 / 3)
    assert found.of[LIKE_A] == pytest.approx(0.2 + 1.0 / 3)
    assert found.of[Explanation((1,))] == pytest.approx(0.2)
    assert sum(found.of.values()) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("sets", "said", "name", "marginal"),
    [
        ({Explanation((0,)): 1.0}, ("slack",), "unexplained", 0.0),
        ({Explanation(()): 0.001, Explanation((0,)): 0.899, LIKE_A: 0.1}, ("slack",), "unexplained", 0.0),
        ({Explanation(()): 0.04, Explanation((0,)): 0.86, LIKE_A: 0.1}, ("slack",), "no_gap", 0.0),
        ({Explanation((0,)): 0.5, Explanation((1,)): 0.4, LIKE_A: 0.1}, ("slack", "gear"), "unexplained", 0.4),
    ],
    ids=["all refuted", "something like it", "hardly less likely nothing", "alternative stays as likely"],
)
def test_where_what_was_refitted_is_refuted_nothing_is_said(
    weighed: Explanations,
    sets: dict[Explanation, float],
    said: tuple[str, ...],
    name: VerdictName,
    marginal: float,
) -> None:
    verdict = Verdict("named" if len(said) == 1 else "inseparable", (said,))
    before = Stood(verdict, Probabilities(("slack", "gear"), sets), refitted("slack"), gap(-0.8, WORSE), ())
    found = stood(before, weighed, lambda names: refitted(*names), lambda _twin: gap(None, None))
    assert found.verdict == Verdict(name, ())
    assert found.best is None
    assert found.probabilities.marginal == pytest.approx([0.0, marginal])
    assert found.refutations == (Refutation("slack", -0.8, WORSE),)
