"""A video that stands still must not pass for a robot at rest, nor the other way round."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tracking.body_jump import exchanged_frames, halted_rows
from tracking.harmed_frames import (
    frozen_flags,
    frozen_picture,
    repeat_flags,
    repeated_rows,
    stopped_clock,
)


def moving(frames: int = 60) -> np.ndarray:
    """(n, 3, 2) three markers that drift by 4 px a frame, px."""
    return np.arange(frames)[:, None, None] * 4.0 + np.arange(3)[None, :, None] * 50.0 + np.zeros(2)


def test_a_picture_that_freezes_is_left_out_but_for_its_first_frame() -> None:
    position = moving()
    position[20:30] = position[20]
    frozen = frozen_picture(position)
    assert list(np.flatnonzero(frozen)) == list(range(21, 30))
    (flag,) = frozen_flags(frozen, ("a", "b", "c"), (), slice(0, 60))
    assert (flag.kind, flag.frames, flag.markers) == ("frozen_marker", (21, 29), ("a", "b", "c"))
    assert "no marker moves for 9 frames" in flag.message


@pytest.mark.parametrize("copies", [1, 2])
@pytest.mark.parametrize("inserted", [True, False])
def test_a_repeated_frame_or_two_is_left_out_and_told(copies: int, inserted: bool) -> None:
    true = moving()
    position = np.concatenate(
        [true[:20], np.repeat(true[19:20], copies, axis=0), true[20 if inserted else 20 + copies :]]
    )
    repeated = repeated_rows(position)
    assert list(np.flatnonzero(repeated)) == list(range(20, 20 + copies))
    assert not frozen_picture(position).any()
    (flag,) = repeat_flags(repeated, position)
    assert ("as if no time had passed" in flag.message) == inserted


def test_markers_rounded_to_pixels_may_rest_together_without_repeating_a_frame() -> None:
    slow = np.round(moving(200) * 0.05)
    assert not repeated_rows(slow).any()
    assert not frozen_picture(slow).any()


@pytest.mark.parametrize("seed", range(8))
def test_few_noisy_markers_rounded_to_half_pixels_repeat_no_frame_by_chance(seed: int) -> None:
    rng = np.random.default_rng(seed)
    way = 25 * np.sin(np.arange(1600) / 16)[:, None, None] * np.array([0.01, 0.03, 1.0])[:, None] * [0.2, 1.0]
    rounded = np.round(2 * (way + rng.normal(0.0, 0.4, way.shape))) / 2
    assert not repeated_rows(rounded).any()


def test_a_frozen_picture_that_is_coded_or_tracked_anew_is_one() -> None:
    position = moving()
    position[20:30] = position[20]
    position += np.random.default_rng(0).normal(0.0, 0.003, position.shape)
    assert list(np.flatnonzero(frozen_picture(position))) == list(range(21, 30))
    assert not frozen_picture(moving() + np.random.default_rng(0).normal(0.0, 0.05, position.shape)).any()


def beating(hz: float, fps: float, random: np.random.Generator) -> np.ndarray:
    """(100, 5, 2) px of a body that swims along and beats from a phase drawn at random."""
    beat = 2 * np.pi * hz * np.arange(100) / fps + random.uniform(0, 6)
    swing = np.sin(beat[:, None] - 0.5 * np.arange(5)) * [3, 2, 10, 25, 40]
    return np.stack([np.arange(5) * 50 - 100 * np.arange(100)[:, None] / fps, swing], axis=-1)


@given(
    hz=st.floats(0.5, 2.5),
    fps=st.floats(40.0, 120.0),
    at=st.integers(5, 90),
    noise_px=st.floats(0.0, 0.2),
    seed=st.integers(0, 999),
)
def test_frames_in_exchanged_order_are_found_and_a_beat_is_not(
    hz: float, fps: float, at: int, noise_px: float, seed: int
) -> None:
    random = np.random.default_rng(seed)
    true = beating(hz, fps, random)
    true += random.normal(0.0, noise_px, true.shape)
    exchanged = true.copy()
    exchanged[[at, at + 1]] = true[[at + 1, at]]

    assert not exchanged_frames(true).any()
    found = list(np.flatnonzero(exchanged_frames(exchanged)))
    assert found in ([], [at, at + 1])
    assert found or np.abs(true[at + 1] - true[at]).max() < 1.0 + 12 * noise_px + 60 * (hz / fps) ** 2 * 40


@given(hz=st.floats(1.0, 2.0), fps=st.floats(50.0, 80.0), seed=st.integers(0, 999))
def test_one_frame_in_six_in_exchanged_order_hides_no_other(hz: float, fps: float, seed: int) -> None:
    random = np.random.default_rng(seed)
    first = np.cumsum(random.integers(5, 17, 20))
    first = first[first < 96]
    true = beating(hz, fps, random)
    true += random.normal(0.0, 0.02, true.shape)
    shown = true.copy()
    for frame in first:
        shown[[frame, frame + 1]] = true[[frame + 1, frame]]
    told = np.flatnonzero(exchanged_frames(shown))

    assert set(told) <= {*first, *(first + 1)}
    assert len(told) >= 0.7 * 2 * len(first)  # the others lie at the turn of a stroke, or at the film's ends


@given(
    hz=st.floats(0.5, 4.0),
    fps=st.floats(30.0, 120.0),
    rounded=st.booleans(),
    copies=st.integers(1, 3),
    seed=st.integers(0, 999),
)
def test_copies_that_are_coded_anew_halt_a_motion_and_a_beat_does_not(
    hz: float, fps: float, rounded: bool, copies: int, seed: int
) -> None:
    random = np.random.default_rng(seed)
    true = beating(hz, fps, random)
    fast = np.linalg.norm(np.diff(true, axis=0), axis=2).max(axis=1)
    middle = 10 + int(np.argmax(fast[10:90]))  # of a stroke
    film = np.concatenate(
        [true[: middle + 1], np.repeat(true[middle : middle + 1], copies, axis=0), true[middle + 1 :]]
    )
    found = [
        halted_rows(np.round(2 * seen) / 2 if rounded else seen)
        for seen in (each + random.normal(0.0, 0.08, each.shape) for each in (true, film))
    ]

    assert not found[0].any()
    if fast[middle] > 5.0 and not rounded:
        assert list(np.flatnonzero(found[1])) == list(range(middle + 1, middle + 1 + copies))


@pytest.mark.parametrize("goes_on", [True, False])
def test_a_film_that_was_stopped_goes_on_where_it_stopped(goes_on: bool) -> None:
    position = moving(80)
    if goes_on:
        position = np.concatenate([position[:21], np.repeat(position[20:21], 9, axis=0), position[21:71]])
    else:
        position[20:30] = position[20]
    frozen = frozen_picture(position)
    assert stopped_clock(frozen, position) == ([30] if goes_on else [])


@pytest.mark.parametrize("every", [2, 5])
def test_tracks_that_are_stored_at_a_higher_rate_lose_the_copies(every: int) -> None:
    frames = np.arange(90)
    copies = frames % every == every - 1
    position = moving(90)[frames - copies]
    np.testing.assert_array_equal(repeated_rows(position), copies & (frames > 0))
    (flag,) = repeat_flags(repeated_rows(position), position)
    assert f"{copies.sum()} of 90 frames repeat the one before" in flag.message
    assert repeat_flags(repeated_rows(moving()), moving()) == []


@pytest.mark.parametrize("amplitude_px", [1.0, 20.0])
def test_a_beat_of_few_frames_that_turns_back_between_two_of_them_repeats_none(amplitude_px: float) -> None:
    """At 3.3 frames a beat, every fifth frame shows the tail at the place of the one before."""
    beat = amplitude_px * np.cos(2 * np.pi * 0.3 * (np.arange(60) - 0.5))
    position = np.round(beat[:, None, None] * np.array([0.6, 0.8]) + np.arange(3)[None, :, None] * 50.0, 6)
    assert (np.diff(position, axis=0) == 0).all(axis=(1, 2)).sum() == 12
    assert not repeated_rows(position).any()


def test_a_robot_that_slows_to_a_rest_is_not_frozen() -> None:
    position = 100 * np.exp(-np.arange(80) / 5.0)[:, None, None] + np.zeros((80, 3, 2))
    assert not frozen_picture(np.round(2 * position) / 2).any()
