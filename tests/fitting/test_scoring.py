"""Marker distances as the contract defines them, on fish made by hand."""

from __future__ import annotations

import numpy as np
import pytest

from fitting.phase import residuals, score
from tests.fitting.swims import by_hand, head_frame_of, straight_swim
from tracking.head_frame import to_head_frame


def test_where_it_began_and_where_it_headed_do_not_matter() -> None:
    position = straight_swim(40)
    cos, sin = np.cos(1.1), np.sin(1.1)
    turned = position @ np.array([[cos, sin], [-sin, cos]]) + np.array([3.0, -2.0])

    assert score(by_hand(position), head_frame_of(turned)) == pytest.approx((0.0, 0.0, 0.0, 0.0, 1.0), abs=1e-12)


def test_both_are_aligned_at_the_first_kept_frame() -> None:
    """A twin 1 cm/s faster is d cm ahead d seconds after the first kept frame, whatever came before."""
    kept = np.arange(40) >= 10
    trial = by_hand(straight_swim(40, 0.1), kept=kept, scored=kept, warmup_s=1.0)
    simulated = head_frame_of(straight_swim(40, 0.11))

    distance = np.linalg.norm(residuals(trial, simulated, kept), axis=-1)  # (30, 5)
    np.testing.assert_allclose(distance, np.repeat(0.01 * np.arange(30)[:, None] / 10, 5, axis=1), atol=1e-12)
    assert score(trial, simulated).marker_error_m == pytest.approx(0.0145)


@pytest.mark.parametrize(("first", "last"), [(10, 25), (5, 29), (20, 33)], ids=["warm-up", "before", "later"])
def test_a_nose_unseen_for_a_while_leaves_the_error_of_the_others_as_it_is(first: int, last: int) -> None:
    """Twin and trial are aligned where they were, and compared in the same frames, the head bridged in both."""
    position, compared = straight_swim(40, 0.1), np.arange(40) >= 10
    seen = (np.arange(40) < first) | (np.arange(40) > last)
    kept = compared & (np.arange(40) >= np.flatnonzero(compared & seen)[0])
    whole = by_hand(position, kept=kept, scored=compared, warmup_s=1.0)
    gappy = position.copy()
    gappy[~seen, 0] = np.nan
    weight = np.where(np.isfinite(gappy).all(axis=-1), 1.0, 0.0)
    trial = whole.seen_as(head=to_head_frame(gappy, 0, 1, seen), weight=weight)

    faster = straight_swim(40, 0.11)
    undisturbed, found = score(whole, head_frame_of(faster)), score(trial, trial.seen_head(faster))
    assert trial.aligned == whole.aligned == 10
    assert not trial.weight[~seen].any()
    others = weight[compared].sum()
    lost = 0.01 * (np.flatnonzero(~seen & compared) - 10).sum() / 10
    expected = (undisturbed.marker_error_m * 5 * 30 - lost) / others
    assert found.marker_error_m == pytest.approx(expected)
    assert found.used_fraction == pytest.approx(others / (5 * 30))


def test_a_turning_and_bending_fish_is_bridged_as_its_twin_is() -> None:
    time_s = np.arange(40) / 10
    bend = np.array([0.0, 0.0, 0.01, 0.02, 0.05]) * np.sin(6 * time_s)[:, None]
    body = straight_swim(40)[..., 0] + 1j * (straight_swim(40)[..., 1] + bend)
    laid = body * np.exp(1j * (0.2 * time_s + 0.1 * np.sin(6 * time_s)))[:, None]
    position = np.stack([laid.real, laid.imag], axis=-1)
    seen = np.abs(np.arange(40) - 20) > 6
    whole = by_hand(position)
    trial = whole.seen_as(head=to_head_frame(position, 0, 1, seen))
    same, other = trial.seen_head(position), trial.seen_head(1.1 * position)
    assert score(trial, same) == pytest.approx((0.0, 0.0, 0.0, 0.0, 1.0), abs=1e-12)
    shape = np.linalg.norm(0.1 * trial.head.shape_m[seen], axis=-1).mean()
    assert score(trial, other).shape_error_m == pytest.approx(shape)


def test_a_slip_and_a_turn_of_the_launch_are_no_error_of_the_twin() -> None:
    """But a twin that is too fast, or bends otherwise, has one."""
    position, since_s = straight_swim(40), np.arange(40)[:, None] / 10
    launched = position + (0.004 * since_s + 0.008 * since_s**2)[..., None] * np.array([0.0, 1.0])

    found = score(by_hand(launched), head_frame_of(position))
    assert found.marker_error_m > 0.03
    assert found.launch_free_error_m == pytest.approx(0.0, abs=1e-9)
    faster = score(by_hand(straight_swim(40, 0.1)), head_frame_of(straight_swim(40, 0.11)))
    assert faster.launch_free_error_m == pytest.approx(faster.marker_error_m)


def test_flagged_samples_count_in_the_distance_over_all_samples_only() -> None:
    position = straight_swim(10)
    off = position.copy()
    off[3:5, 4] += [0.0, 0.2]
    weight = np.ones((10, 5))
    weight[3:5, 4] = 0.0
    trial = by_hand(off).seen_as(weight=weight)

    found = score(trial, head_frame_of(position))
    assert found.marker_error_m == pytest.approx(0.0)
    assert found.shape_error_m == pytest.approx(0.0)
    assert found.marker_error_all_m == pytest.approx(2 * 0.2 / 50)
    assert found.used_fraction == pytest.approx(48 / 50)


def test_the_shape_is_compared_relative_to_the_nose_in_every_frame() -> None:
    """Swimming faster is no error of shape; a bent tail is one of each marker that it moves."""
    position = straight_swim(20, 0.3)
    assert score(by_hand(straight_swim(20, 0.1)), head_frame_of(position)).shape_error_m == pytest.approx(0.0)

    position[:, 4, 1] += 0.05
    found = score(by_hand(straight_swim(20, 0.3)), head_frame_of(position))
    assert found.shape_error_m == pytest.approx(0.05 / 5)
    assert found.marker_error_m == pytest.approx(0.05 / 5)
