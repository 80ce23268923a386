"""The published objective made smooth: its derivatives, and that batches and orders change nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fitting.mean_distance import SOFTENING_M, MeanDistance
from fitting.objective import Swims
from fitting.search_space import PHASE_STEP_RAD, ROOT_STEP, SearchSpace

ERRORS = 7
errors_m = arrays(float, (2 * ERRORS, 1), elements=st.floats(-0.2, 0.2))
POINT = np.array([0.5, 3.0, 5.0, 4.0, 1.0, 1.1, 4.1])


def some_norm(seed: int = 0) -> MeanDistance:
    weight = np.random.default_rng(seed).random(ERRORS) + 0.05
    return MeanDistance(weight / weight.sum())


@given(r=errors_m)
def test_its_gradient_is_that_of_finite_differences(r: np.ndarray) -> None:
    norm, step = some_norm(), 1e-6
    gradient, _ = norm.grad_hess(r, np.eye(2 * ERRORS))
    moves = step * np.eye(2 * ERRORS)[:, :, None]
    differences = [(norm.value(r + move) - norm.value(r - move)) / (2 * step) for move in moves]

    np.testing.assert_allclose(gradient[:, 0], differences, atol=1e-7)


@given(r=errors_m, other=errors_m)
def test_the_quadratic_of_its_curvature_lies_above_it_everywhere(r: np.ndarray, other: np.ndarray) -> None:
    """So that a full Gauss-Newton step on it always descends."""
    norm, move = some_norm(), other - r
    gradient, curvature = norm.grad_hess(r, np.eye(2 * ERRORS))
    above = norm.value(r) + float((gradient.T @ move + move.T @ curvature @ move / 2).item())

    assert norm.value(other) <= above + 1e-12


@given(r=errors_m)
def test_it_is_the_weighted_mean_distance_to_within_its_softening(r: np.ndarray) -> None:
    weight = np.full(ERRORS, 1 / ERRORS)
    mean = float(np.linalg.norm(r.reshape(-1, 2), axis=1).mean())

    assert mean - SOFTENING_M <= MeanDistance(weight).value(r) <= mean + 1e-15


def columns_around(point: np.ndarray, count: int) -> np.ndarray:
    return np.abs(point[:, None] + 0.1 * np.random.default_rng(2).normal(size=(len(point), count)))


def test_a_batch_gives_what_single_simulations_give(swims: Swims) -> None:
    columns = columns_around(POINT, 4)
    single = np.concatenate([swims.errors(columns[:, [i]]) for i in range(4)], axis=1)

    np.testing.assert_array_equal(swims.errors(columns), single)


def test_flagged_samples_do_not_enter(swims: Swims) -> None:
    slow = swims.trials[0]
    weight, head = slow.weight.copy(), slow.head
    weight[90:150, 7] = 0.0
    shape = head.shape_m.copy()
    shape[90:150, 7] += 5.0
    broken = replace(slow, weight=weight, head=replace(head, shape_m=shape))
    column = POINT[:6, None]

    flagged = Swims(swims.twin, (replace(slow, weight=weight),)).mean_distance(column)
    assert Swims(swims.twin, (broken,)).mean_distance(column) == pytest.approx(flagged)


def test_slopes_point_where_the_errors_go(swims: Swims) -> None:
    """Against differences half as wide again; Kutta lift that changes sides roughens the errors."""
    space = SearchSpace(swims)
    x = np.append(np.sqrt(POINT[:5]), POINT[5:])[:, None]
    slopes = space.slopes(x, np.empty(0))
    for i in range(space.size):
        step = 1.5 * (ROOT_STEP if i < 5 else PHASE_STEP_RAD) * np.eye(space.size)[:, [i]]
        wider = ((space.errors(x + step) - space.errors(x - step)) / (2 * step[i]))[:, 0]
        lengths = np.linalg.norm(slopes[:, i]), np.linalg.norm(wider)
        assert slopes[:, i] @ wider > 0.9 * np.prod(lengths)
        assert lengths[0] == pytest.approx(lengths[1], rel=0.3)
