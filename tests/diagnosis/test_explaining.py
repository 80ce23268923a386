"""How large the twin's own error is in a session is found beside whatever gap there is."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from diagnosis.constants import SCALES
from diagnosis.discrepancy import Discrepancy
from diagnosis.evidence import Priors
from diagnosis.hypotheses import Hypothesis, Probabilities, average_hypotheses, error_sizes
from diagnosis.linear_model import LinearModel
from diagnosis.verdict import Verdict, borderline, verdict_of
from fitting.signatures import Whitened
from tests.cases import later
from tests.diagnosis.rows import DIRECTIONS, K, catalogue

ERROR = 2.0  # the twin errs by that in a session like most, beside noise of one


LAUNCH = 20.0  # what a usual launch adds to each number of the course
COURSE = np.arange(K - 6, K)
NO_NUMBERS = SimpleNamespace(frequencies=0, of_rings=0, beside=0, measured=(), places_of_creeps=slice(0, 0))


@dataclass(frozen=True, eq=False)
class Row:
    """A linear model without a simulation."""

    residual: np.ndarray
    discrepancy: Discrepancy = field(default_factory=lambda: Discrepancy.independent(np.eye(1)))
    error: float = 1.0
    common: np.ndarray = field(default_factory=lambda: np.zeros((1, 0)))
    launch: tuple[float, float] = (0.0, 0.0)
    generic_root: np.ndarray = field(default_factory=lambda: np.eye(K))
    model: SimpleNamespace = field(default_factory=lambda: NO_NUMBERS)

    @property
    def observed(self) -> np.ndarray:
        return np.ones(K, bool)

    def with_error(self, error: float, common: np.ndarray, launch: tuple[float, float] = (0.0, 0.0)) -> Row:
        return replace(self, error=error, common=common, launch=launch)

    @cached_property
    def space(self) -> Whitened:
        covariance = (1 + (self.error * ERROR) ** 2) * np.eye(K) + self.common @ self.common.T
        covariance[COURSE, COURSE] += (LAUNCH * self.launch[0]) ** 2
        return Whitened.of(covariance, np.eye(K)[:, :5], np.full(5, 10.0))


def linear(seed: int, error: float, gap: np.ndarray) -> LinearModel:
    noise = np.sqrt(1 + (error * ERROR) ** 2) * np.random.default_rng([seed, 8]).standard_normal(K)
    return cast(LinearModel, Row(noise + gap))


@pytest.mark.parametrize("gap", [0.0, *later(15.0), 45.0])
@pytest.mark.parametrize("error", [0.3, 0.7, *later(1.4, 2.0)])
def test_the_error_of_a_session_is_found_whatever_the_gap(error: float, gap: float) -> None:
    found = average_hypotheses(error_sizes(linear(1, error, gap * DIRECTIONS[4]), catalogue()), catalogue(), Priors())
    assert found.linear.error == error
    assert gap or verdict_of(found.probabilities).name == "no_gap"
    if gap >= 15 * error:
        assert found.probabilities.marginal[4] > 0.6


@pytest.mark.parametrize("launch", [*later(0.0, 1.0), 4.0])
def test_launches_that_differ_are_no_gap(launch: float) -> None:
    """What launches differ by is no cause, however much it is, and a cause beside it is found all the same."""
    differs = np.zeros(K)
    differs[COURSE] = launch * LAUNCH * np.random.default_rng(4).standard_normal(len(COURSE))
    found = average_hypotheses(error_sizes(linear(1, 1.0, differs), catalogue()), catalogue(), Priors())
    assert verdict_of(found.probabilities).name == "no_gap"
    assert found.linear.launch[0] == launch
    beside = linear(1, 1.0, differs + 60.0 * DIRECTIONS[4])
    found = average_hypotheses(error_sizes(beside, catalogue()), catalogue(), Priors())
    assert found.probabilities.marginal[4] > 0.6


@pytest.mark.long
def test_what_few_sessions_show_far_more_of_makes_a_name_less_sure() -> None:
    known = replace(Discrepancy.independent(np.eye(1)), strengths={"effect_4": (0.5,)})
    row = cast(Row, linear(2, 0.7, 25.0 * DIRECTIONS[4]))
    usual, few = (
        average_hypotheses(
            error_sizes(cast(LinearModel, replace(row, discrepancy=each)), catalogue()), catalogue(), Priors()
        ).probabilities
        for each in (known, replace(known, heavy={"effect_4": (3.0, 0.1)}))
    )
    assert few.null > usual.null


@pytest.mark.long
def test_probabilities_are_averaged_over_the_sizes_of_the_error() -> None:
    at = linear(3, 0.85, 8.5 * DIRECTIONS[4])
    found = average_hypotheses(error_sizes(at, catalogue()), catalogue(), Priors())
    alone = []
    for error in SCALES:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("diagnosis.hypotheses.SCALES", {error: 1.0})
            alone.append(average_hypotheses(error_sizes(at, catalogue()), catalogue(), Priors()).probabilities.null)
    assert min(alone) < found.probabilities.null < max(alone)
    assert sum(found.probabilities.of.values()) == pytest.approx(1.0)


@pytest.mark.parametrize(("chance", "near"), [(0.979, "named"), (0.9795, "named"), (0.9805, "no_gap"), (0.99, None)])
def test_a_verdict_near_a_threshold_says_so(chance: float, near: str | None) -> None:
    found = Probabilities(("one", "other"), {Hypothesis(()): 1 - chance, Hypothesis((0,)): chance})
    said = verdict_of(found)
    other = borderline(said, found)
    assert (None if other is None else other.name) == near
    assert borderline(Verdict("unexplained", ()), found) is None  # a verdict for another reason
