"""The published objective: batches change nothing, and flagged samples do not count."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fitting.published import Swims

POINT = np.array([0.5, 3.0, 5.0, 4.0, 1.0, 1.1, 4.1])


def columns_around(point: np.ndarray, count: int) -> np.ndarray:
    return np.abs(point[:, None] + 0.1 * np.random.default_rng(2).normal(size=(len(point), count)))


def test_a_batch_gives_what_single_simulations_give(swims: Swims) -> None:
    columns = columns_around(POINT, 4)
    single = np.concatenate([swims.mean_distance(columns[:, [i]]) for i in range(4)])

    np.testing.assert_allclose(swims.mean_distance(columns), single, rtol=1e-12)


def test_flagged_samples_do_not_enter(swims: Swims) -> None:
    slow = swims.trials[0]
    weight, head = slow.weight.copy(), slow.head
    weight[90:150, 7] = 0.0
    shape = head.shape_m.copy()
    shape[90:150, 7] += 5.0
    broken = slow.seen_as(weight=weight, head=replace(head, shape_m=shape))
    column = POINT[:6, None]

    flagged = Swims(swims.twin, (slow.seen_as(weight=weight),)).mean_distance(column)
    assert Swims(swims.twin, (broken,)).mean_distance(column) == pytest.approx(flagged)
