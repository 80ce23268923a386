"""A set of effects that leaves more than noise names nothing and keeps no probability above a half."""

from __future__ import annotations

from typing import cast

import numpy as np
import pytest

from diagnosis.constants import ADEQUATE
from diagnosis.diagnose import WeighedEvidence, adequacy
from diagnosis.evidence import Priors
from diagnosis.hypotheses import Hypothesis, Probabilities, average_hypotheses, error_sizes
from diagnosis.places import ForceResponses
from tests.cases import later
from tests.diagnosis.rows import DIRECTIONS, K, catalogue
from tests.diagnosis.test_explaining import linear

STRANGE = np.random.default_rng(6).standard_normal(K)  # in no catalogue
STRANGE /= np.linalg.norm(STRANGE)


def weighed(gap: np.ndarray, seed: int) -> WeighedEvidence:
    row = linear(seed, 1.0, gap)
    found = average_hypotheses(error_sizes(row, catalogue()), catalogue(), Priors())
    nothing = cast(ForceResponses, None)
    return WeighedEvidence(found.linear, (), nothing, (), found.hypotheses, found.probabilities, {})


@pytest.mark.parametrize("seed", [0, *later(1, 2, 3)])
@pytest.mark.parametrize("strength", [0.0, *later(40.0), 200.0])
def test_effects_of_the_catalogue_leave_only_noise(seed: int, strength: float) -> None:
    assert adequacy(weighed(strength * DIRECTIONS[4], seed), None).p_value > ADEQUATE


@pytest.mark.parametrize("seed", [2, *later(0, 1, 3)])
def test_what_is_in_no_catalogue_is_not_explained_by_it(seed: int) -> None:
    found = adequacy(weighed(40.0 * DIRECTIONS[4] + 150.0 * STRANGE, seed), None)
    assert found.p_value < ADEQUATE
    assert found.squares > 1.3 * found.numbers


def test_doubted_names_share_their_probability_with_something_else() -> None:
    sure = {Hypothesis(()): 0.01, Hypothesis((0,)): 0.9, Hypothesis((0, 1), True): 0.09}
    found = Probabilities(("one", "other"), sure).doubted()
    assert found.null == pytest.approx(0.01)
    assert found.marginal[0] == pytest.approx(0.495)
    assert found.other == pytest.approx(0.495)
    assert sum(found.of.values()) == pytest.approx(1.0)
