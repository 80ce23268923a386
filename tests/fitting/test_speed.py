"""Forward speed: net displacement along the mean heading, untilted by beat, frame rate and gaps."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fitting.pool import forward_speed, whole_beats
from tracking.head_frame import HeadFrame, to_head_frame


def times(seconds: float, fps: float = 60.0) -> np.ndarray:
    return np.arange(round(seconds * fps) + 1) / fps


def all_of(time_s: np.ndarray) -> np.ndarray:
    return np.ones(len(time_s), bool)


def beating(
    time_s: np.ndarray, hz: float, speed: float, turning: float = 0.0, phase: float = 0.0, heading: float = 0.0
) -> HeadFrame:
    """A fish whose nose sways by 10 mm and whose head yaws by 0.13 rad as it swims (n, 2, 2), seen at times (n,)."""
    beat = 2 * np.pi * hz * time_s + phase
    course = heading + turning * time_s
    velocity = -speed * np.exp(1j * course)
    path = np.concatenate([[0], np.cumsum(0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time_s))])
    nose = path + 1j * np.exp(1j * course) * 0.010 * np.sin(beat) + np.exp(1j * course) * 0.002 * np.cos(2 * beat)
    neck = nose + 0.142 * np.exp(1j * (course + 0.13 * np.sin(beat + 1.0)))
    both = np.stack([nose, neck], axis=1)
    return to_head_frame(np.stack([both.real, both.imag], axis=-1), 0, 1)


@pytest.mark.parametrize("phase", np.linspace(0, 2 * np.pi, 9))
@pytest.mark.parametrize("seconds", [2.0, 2.9, 6.1])
def test_no_phase_of_the_beat_tilts_it(phase: float, seconds: float) -> None:
    time_s = times(seconds)

    found = forward_speed(time_s, beating(time_s, 0.75, 0.1, phase=phase), all_of(time_s), 0.75)
    assert found == pytest.approx(0.1, rel=3e-4)


@given(fps=st.floats(20.0, 120.0), hz=st.floats(0.4, 2.0), heading=st.floats(-3.0, 3.0), phase=st.floats(0.0, 6.0))
def test_the_frame_rate_and_the_way_the_pool_lies_do_not_matter(
    fps: float, hz: float, heading: float, phase: float
) -> None:
    time_s = times(5.0, fps)

    found = forward_speed(time_s, beating(time_s, hz, 0.15, phase=phase, heading=heading), all_of(time_s), hz)
    assert found == pytest.approx(0.15, rel=6e-4)


def test_of_a_bent_course_it_is_the_chord() -> None:
    time_s = times(6.0)
    turned = 0.1 * time_s[-1]

    found = forward_speed(time_s, beating(time_s, 1.0, 0.1, turning=0.1), all_of(time_s), 1.0)
    assert found == pytest.approx(0.1 * (1 - turned**2 / 40), rel=4e-3)


def test_an_empty_end_is_no_standing_still_and_a_gap_is_no_detour() -> None:
    time_s = times(6.0)
    swum = beating(time_s, 1.0, 0.1)
    unseen = (time_s > 4.5) | ((time_s > 2.0) & (time_s < 2.4))
    gappy = replace(swum, heading_rad=np.where(unseen, np.nan, swum.heading_rad))

    assert forward_speed(time_s, gappy, all_of(time_s), 1.0) == pytest.approx(0.1, rel=1e-3)


def test_of_several_those_that_diverged_have_none() -> None:
    time_s = times(3.0)
    one = beating(time_s, 1.0, 0.1)
    both = HeadFrame(
        *(np.stack([getattr(one, part.name), np.full_like(getattr(one, part.name), np.nan)]) for part in fields(one))
    )

    found = forward_speed(time_s, both, all_of(time_s), 1.0)
    assert found[0] == pytest.approx(0.1, rel=1e-3)
    assert np.isnan(found[1])


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


@pytest.mark.parametrize("count", [0, 2, 11])
def test_too_few_frames_have_no_speed(count: int) -> None:
    time_s = times(1.0)
    found = forward_speed(time_s, beating(time_s, 1.0, 0.1), np.arange(len(time_s)) < count, 1.0)

    assert np.isnan(found) == (count < 3)
