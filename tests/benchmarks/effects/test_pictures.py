"""Faults of camera, clock and tracker do to tracks in pixels what they say."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.effects.pictures import PixelTracks, clock, drift, lens, offset, shaken, shutter

MARKERS = ("nose", "neck", "tail_1")
PX_PER_M, SIZE_PX = 900.0, np.array([1920.0, 1080.0])


def swim(angle_rad: float, speed_px_s: float = 120.0) -> PixelTracks:
    """Make a straight swim at an even speed, with the fish along its way."""
    time_s = np.arange(120) / 60.0
    ahead = np.array([np.cos(angle_rad), np.sin(angle_rad)])
    places = np.array([0.0, -130.0, -200.0])[None, :] + speed_px_s * time_s[:, None]
    return PixelTracks(time_s, SIZE_PX / 2 + places[..., None] * ahead, MARKERS, PX_PER_M, SIZE_PX)


@given(angle_rad=st.floats(0, 6.28), aside_m=st.floats(-0.02, 0.02))
def test_an_offset_moves_one_marker_square_to_the_head(angle_rad: float, aside_m: float) -> None:
    before = swim(angle_rad)
    moved = offset("tail_1", aside_m)(before).position_px - before.position_px
    assert np.abs(moved[:, :2]).max() == 0
    np.testing.assert_allclose(np.linalg.norm(moved[:, 2], axis=1), abs(aside_m) * PX_PER_M, atol=1e-9)
    assert np.abs((moved[:, 2] * (before.position_px[:, 0] - before.position_px[:, 1])).sum(axis=1)).max() < 1e-6


@given(angle_rad=st.floats(0, 6.28))
def test_a_drift_grows_with_time(angle_rad: float) -> None:
    before = swim(angle_rad)
    way_px = np.linalg.norm(drift("tail_1", 0.006)(before).position_px - before.position_px, axis=-1)
    np.testing.assert_allclose(way_px[:, 2], 0.006 * PX_PER_M * before.time_s, atol=1e-9)


def test_a_lens_leaves_the_middle_and_scales_the_lower_edge() -> None:
    places = np.array([[SIZE_PX / 2, SIZE_PX / 2 + (0, 540), SIZE_PX / 2 + (270, 0)]])
    seen = lens(-0.08)(PixelTracks(np.zeros(1), places, MARKERS, PX_PER_M, SIZE_PX)).position_px - SIZE_PX / 2
    np.testing.assert_allclose(seen[0], [(0, 0), (0, 540 * 0.92), (270 * (1 - 0.08 / 4), 0)])


@given(angle_rad=st.floats(0, 6.28))
def test_a_shutter_shows_a_marker_where_it_is_when_its_line_is_read(angle_rad: float) -> None:
    before, readout_s = swim(angle_rad), 0.025
    seen = shutter(readout_s)(before).position_px
    ahead = np.array([np.cos(angle_rad), np.sin(angle_rad)])
    late_s = readout_s * seen[..., 1] / SIZE_PX[1]
    inside = before.time_s < before.time_s[-1] - readout_s
    expected = before.position_px + 120.0 * late_s[..., None] * ahead
    np.testing.assert_allclose(seen[inside], expected[inside], atol=1e-3)


def test_a_clock_stretches_the_stamps_and_a_shake_moves_all_markers_alike() -> None:
    before = swim(0.3)
    slow, moved = clock(1.06)(before), shaken(5.0)(before)
    assert slow.time_s[-1] == pytest.approx(1.06 * before.time_s[-1])
    assert (slow.position_px == before.position_px).all()
    by_px = moved.position_px - before.position_px
    assert np.ptp(by_px, axis=(1, 2)).max() < 1e-9
    assert 4.0 < np.abs(by_px).max() <= 5.0
