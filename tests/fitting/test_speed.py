"""Forward speed: the slope of the distance swum, untilted by the beat."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fitting.speed import forward_speed, whole_beats


def times(seconds: float, fps: float = 60.0) -> np.ndarray:
    return np.arange(round(seconds * fps) + 1) / fps


def all_of(time_s: np.ndarray) -> np.ndarray:
    return np.ones(len(time_s), bool)


def test_of_a_line_it_is_exact() -> None:
    time_s = times(2.7)

    assert forward_speed(time_s, 0.3 - 0.123 * time_s, all_of(time_s), 1.0) == pytest.approx(-0.123)
    many = np.array([0.1, 0.2, -0.05])
    np.testing.assert_allclose(forward_speed(time_s, many[:, None] * time_s, all_of(time_s), 1.0), many)


@pytest.mark.parametrize("phase", np.linspace(0, 2 * np.pi, 9))
def test_over_whole_beats_no_wave_tilts_it_further_than_an_odd_one(phase: float) -> None:
    """An odd wave of amplitude a, n times in T, leaves a slope of 6 a / (pi n T)."""
    time_s, hz, seconds = times(2.9), 0.75, 2 / 0.75
    swum = 0.1 * time_s + 0.004 * np.sin(4 * np.pi * hz * time_s + phase)
    limit = 6 * 0.004 / (np.pi * 4 * seconds)

    assert abs(forward_speed(time_s, swum, all_of(time_s), hz) - 0.1) <= 1.02 * limit


@given(seconds=st.floats(0.3, 9.0), hz=st.floats(0.3, 3.0), start=st.floats(0.0, 1.0))
def test_whole_beats_are_whole_and_as_many_as_fit(seconds: float, hz: float, start: float) -> None:
    time_s = times(start + seconds)
    kept = time_s >= start
    used = whole_beats(time_s, kept, hz)
    frame, span = 1 / 60, (kept.sum()) / 60

    assert not (used & ~kept).any()
    if span * hz < 1 - 1e-6:
        assert (used == kept).all()
    else:
        beats = used.sum() * frame * hz
        assert abs(beats - round(beats)) <= 1.01 * frame * hz
        assert beats > span * hz - 1 - 1.01 * frame * hz
        assert used[np.flatnonzero(kept)[0]]


@pytest.mark.parametrize("count", [0, 1, 11])
def test_too_few_frames_have_no_speed(count: int) -> None:
    time_s = times(1.0)

    assert np.isnan(forward_speed(time_s, time_s, np.arange(len(time_s)) < count, 1.0)) == (count < 2)
