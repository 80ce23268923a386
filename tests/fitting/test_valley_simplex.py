"""A simplex in the shape of the valley goes along it where one along the coefficients creeps."""

from __future__ import annotations

import numpy as np
import pytest

from fitting.objective import Swims
from fitting.published_objective import PublishedObjective
from fitting.published_search import nelder_mead
from fitting.search_space import SearchSpace
from fitting.valley_simplex import LONGEST, RISE_M, _edges, descend_in_valley
from synthetic import PLAUSIBLE_COEFFICIENTS
from tests.fitting.exact_swims import PHASES, exact_swims, exact_twin

BUDGET_S = 600.0
START = np.append(np.array(PLAUSIBLE_COEFFICIENTS) * [1.1, 0.95, 1.1, 0.97, 1.3], PHASES[:2] + 0.02)


@pytest.fixture(scope="module")
def swims() -> Swims:
    return Swims(exact_twin(), exact_swims(hz=(0.7, 1.2), seconds=3.5))


def started(swims: Swims) -> PublishedObjective:
    objective = PublishedObjective(swims, BUDGET_S)
    objective(START[:, None])
    return objective


@pytest.mark.long
def test_for_the_same_budget_it_comes_lower_than_a_simplex_along_the_coefficients(swims: Swims) -> None:
    shaped, plain = started(swims), started(swims)
    descend_in_valley(shaped, BUDGET_S)
    nelder_mead(plain, BUDGET_S, START)

    assert shaped.best_m < plain.best_m < started(swims).best_m
    assert shaped.spent_s < BUDGET_S + 40.0
    assert ((shaped.best_point[:5] >= 0) & (shaped.best_point[:5] <= 10)).all()


def test_along_the_edges_that_are_not_cut_short_the_objective_rises_alike(swims: Swims) -> None:
    """By what they are made for, from its lowest point; the longest ones leave the range where curvature tells."""
    space = SearchSpace(swims)
    lowest = np.append(np.sqrt(PLAUSIBLE_COEFFICIENTS), PHASES[:2])
    edges = _edges(space, lowest)
    rises = space.objectives(lowest[:, None] + edges) - space.objectives(lowest[:, None])

    assert np.linalg.norm(edges, axis=0).max() <= LONGEST * (1 + 1e-9)
    np.testing.assert_allclose(rises[3:], RISE_M, rtol=0.4)
