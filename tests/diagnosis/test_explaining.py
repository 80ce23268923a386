"""How large the twin's own error is in a session is found beside whatever gap there is."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from diagnosis.discrepancy import Discrepancy
from diagnosis.evidence import Priors
from diagnosis.explaining import explained
from diagnosis.ground import Ground
from diagnosis.probabilities import Probabilities
from diagnosis.verdict import verdict_of
from fitting.signatures import Whitened
from tests.cases import later
from tests.diagnosis.rows import DIRECTIONS, K, catalogue

ERROR = 2.0  # of the twin in a session like most, beside noise of one


NO_NUMBERS = SimpleNamespace(frequencies=0, of_rings=0, beside=0, measured=())


@dataclass(frozen=True, eq=False)
class Row:
    """A ground without a simulation."""

    left: np.ndarray
    discrepancy: Discrepancy = field(default_factory=lambda: Discrepancy.independent(np.eye(1)))
    error: float = 1.0
    alike: np.ndarray = field(default_factory=lambda: np.zeros((1, 0)))
    generic: np.ndarray = field(default_factory=lambda: np.eye(K))
    model: SimpleNamespace = field(default_factory=lambda: NO_NUMBERS)

    def with_error(self, error: float, alike: np.ndarray) -> Row:
        return replace(self, error=error, alike=alike)

    @cached_property
    def space(self) -> Whitened:
        covariance = (1 + (self.error * ERROR) ** 2) * np.eye(K) + self.alike @ self.alike.T
        return Whitened.of(covariance, np.eye(K)[:, :5], np.full(5, 10.0))


def ground(seed: int, error: float, gap: np.ndarray) -> Ground:
    noise = np.sqrt(1 + (error * ERROR) ** 2) * np.random.default_rng([seed, 8]).standard_normal(K)
    return cast(Ground, Row(noise + gap))


@pytest.mark.parametrize("gap", [0.0, 15.0, 45.0])
@pytest.mark.parametrize("error", [0.7, *later(1.4), 2.0])
def test_the_error_of_a_session_is_found_whatever_the_gap(error: float, gap: float) -> None:
    found = explained(ground(1, error, gap * DIRECTIONS[4]), catalogue(), Priors())
    assert found.ground.error == error
    assert gap or verdict_of(found.probabilities).name == "no_gap"
    if gap >= 15 * error:
        assert found.probabilities.marginal[4] > 0.7


@pytest.mark.parametrize(("strength", "named"), [(25.0, False), (90.0, True)])
def test_what_few_sessions_show_far_more_of_is_no_surer_than_that(strength: float, named: bool) -> None:
    """Of five standard deviations most sessions would make a name, of eighteen all."""
    known = replace(Discrepancy.independent(np.eye(1)), strengths={"effect_4": (0.5,)})
    row = cast(Ground, replace(cast(Row, ground(2, 0.7, strength * DIRECTIONS[4])), discrepancy=known))
    beside = explained(row, catalogue(), Priors())
    usual = beside.probabilities
    assert verdict_of(usual).name == "named"
    few = replace(known, heavy={"effect_4": (3.0, 0.1)})
    found = explained(cast(Ground, replace(cast(Row, row), discrepancy=few)), catalogue(), Priors())
    assert (verdict_of(found.probabilities).name == "named") == named
    assert found.probabilities.null >= usual.null


def test_between_two_sizes_a_gap_is_no_surer_than_both_let_it_be() -> None:
    found = explained(ground(3, 0.85, 8.5 * DIRECTIONS[4]), catalogue(), Priors())
    chances, of_errors = zip(*((chance, Probabilities.after(one)) for chance, one in found.of_errors), strict=True)
    assert sum(chance > 0.1 for chance in chances) == 2
    nulls, average = [each.null for each in of_errors], found.probabilities
    assert max(nulls) > 1.5 * min(nulls)
    assert average.null == pytest.approx(np.dot(chances, nulls))
    assert average.marginal == pytest.approx(np.dot(chances, [each.marginal for each in of_errors]))
    assert sum(average.of.values()) == pytest.approx(1.0)
