"""The published objective: batches change nothing, and flagged samples do not count."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fitting.phase import score, swim
from fitting.pool import head_frame
from fitting.published import Swims
from tracking.head_frame import select_head

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


def test_a_gap_over_the_end_of_what_is_scored_is_bridged_as_the_score_bridges_it(swims: Swims) -> None:
    """The simulation goes on until the head is seen again."""
    slow = swims.trials[0]
    last = int(np.flatnonzero(slow.scored)[-1]) - 10
    scored = slow.scored & (np.arange(len(slow.time_s)) <= last)
    seen = np.abs(np.arange(len(slow.time_s)) - last) > 7
    gappy = replace(slow, scored=scored).seen_as(head=head_frame(slow.markers, slow.position_m, seen))
    column = POINT[:6, None]
    twin = Swims(swims.twin, (gappy,))
    assert twin.simulate(column)[0].shape_m.shape[1] == last + 9

    whole = swim(swims.twin, gappy, column[:5].T, column[5], gappy.frequency.hz)
    assert twin.mean_distance(column) == pytest.approx(score(gappy, select_head(whole, 0)).marker_error_m, rel=1e-9)
