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
from diagnosis.refutation import refutation_of
from tests.diagnosis.rows import DIRECTIONS, K, Made, explanations, signature

WORSE = (-1.6, -0.1)


def gap(value: float | None, interval: tuple[float, float] | None) -> Gap:
    return Gap(Shrinkage(2.0, 3.0, value, interval), (), (), 1e-3, None)


def refitted(*names: str) -> Refit:
    size = 5 + len(names)
    return Refit(tuple(map(Made, names)), np.ones(5), np.zeros(len(names)), np.zeros(K), np.eye(size))


@pytest.fixture(scope="module")
def weighed() -> Explanations:
    """Of two effects; the second changes but the last number of the row, which holds a frequency."""
    made = [signature("slack", DIRECTIONS[0]), signature("gear", np.eye(K)[K - 1])]
    found = explanations(9 * DIRECTIONS[0] + 9 * np.eye(K)[K - 1], made)
    return replace(found, frequencies=slice(K - 1, K))


@pytest.mark.parametrize(
    ("names", "value", "interval", "refuted"),
    [
        (("slack",), -0.8, WORSE, True),
        (("slack", "gear"), -0.8, WORSE, True),
        (("slack",), -0.8, (-1.6, 0.05), False),
        (("slack",), 0.8, (0.5, 0.9), False),
        (("slack",), None, None, False),
        (("gear",), -0.8, WORSE, False),
    ],
)
def test_only_what_makes_forecasts_of_gaits_surely_worse_is_refuted(
    weighed: Explanations,
    names: tuple[str, ...],
    value: float | None,
    interval: tuple[float, float] | None,
    refuted: bool,
) -> None:
    found = refutation_of(gap(value, interval), refitted(*names), weighed)
    assert (found is not None) == refuted
    if found is not None:
        assert found == (names, value, interval)


def test_without_names_or_held_out_swims_nothing_is_refuted(weighed: Explanations) -> None:
    assert refutation_of(None, refitted("slack"), weighed) is None
    assert refutation_of(gap(None, None), None, weighed) is None


def test_what_is_refuted_becomes_something_that_looks_like_it() -> None:
    sets = {Explanation(()): 0.05, Explanation((0,)): 0.6, Explanation((0, 1)): 0.2, Explanation((1,), True): 0.15}
    found = Probabilities(("a", "b"), sets).refuted(["a"])
    assert found.marginal == pytest.approx([0.0, 0.35])
    assert found.null == 0.05
    assert found.other == pytest.approx(0.6)
    assert found.of[Explanation((1,), True, 0)] == pytest.approx(0.2)
    assert found.any_seen([0]) == pytest.approx(0.8)
