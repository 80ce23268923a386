"""Forward speed: the slope of the distance swum, untilted by the beat; and errors of speeds with their intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from fitting import CalibratedTrial, MeasuredTrial
from fitting.scoring import Scores
from fitting.speed import forward_speed, speed_standard_error, whole_beats
from fitting.speed_errors import speed_errors
from tests.cases import later
from tests.fitting.swims import by_hand, head_frame_of, straight_swim


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


def errors_of_tracks(frames: int, lasting: float, random: np.random.Generator) -> np.ndarray:
    """(frames,) AR(1) of standard deviation 1 mm that lasts so many frames."""
    keep = np.exp(-1 / lasting) if lasting > 0 else 0.0
    fresh = np.sqrt(1 - keep**2) * random.normal(size=frames + 300)
    return 1e-3 * lfilter([1.0], [1.0, -keep], fresh)[300:]


def coverage(beats: float, hz: float, lasting_beats: float, draws: int = 600) -> float:
    """Share of 95 % intervals that hold the speed a swim without errors would show."""
    random, time_s = np.random.default_rng(0), times(beats / hz)
    clean = 0.12 * time_s + 0.003 * np.cos(4 * np.pi * hz * time_s + 1)
    true, hits = forward_speed(time_s, clean, all_of(time_s), hz), 0
    for _ in range(draws):
        swum = clean + errors_of_tracks(len(time_s), lasting_beats / hz * 60, random)
        se = speed_standard_error(time_s, swum, all_of(time_s), hz)
        hits += abs(forward_speed(time_s, swum, all_of(time_s), hz) - true) < 1.96 * se
    return hits / draws


@pytest.mark.parametrize("lasting_beats", [0.1, *later(0.0, 0.4, 0.8)])
@pytest.mark.parametrize(("beats", "hz"), [(12.0, 0.8), *later((4.2, 0.6), (6.0, 1.2))])
def test_at_all_speeds_its_intervals_hold(beats: float, hz: float, lasting_beats: float) -> None:
    assert (0.92 if lasting_beats < 0.5 else 0.85) < coverage(beats, hz, lasting_beats) < 0.999


@pytest.mark.parametrize("count", [0, 1, 11])
def test_too_few_frames_have_no_speed_and_no_standard_error(count: int) -> None:
    time_s = times(1.0)

    assert np.isnan(forward_speed(time_s, time_s, np.arange(len(time_s)) < count, 1.0)) == (count < 2)
    assert np.isnan(speed_standard_error(time_s, time_s, np.arange(len(time_s)) < count, 1.0))


FRAMES, FPS, SPEED = 181, 60.0, 0.1


def measured(seed: int, noise: float = 1.0) -> MeasuredTrial:
    """A swim of three beats whose path is known to a millimetre."""
    position = straight_swim(FRAMES, SPEED, FPS)
    position[..., 0] += noise * errors_of_tracks(FRAMES, 6.0, np.random.default_rng(seed))[:, None]
    return by_hand(position, fps=FPS, speed=SPEED)


def trials(errors: Sequence[float], noise: float = 1.0) -> list[CalibratedTrial]:
    """Trials whose twin is off by so much, and whose theory by twice as much, m/s."""
    made = []
    for i, error in enumerate(errors):
        trial = replace(measured(i, noise), name=f"trial {i}")
        speeds = {"twin": SPEED + error, "published": SPEED + 2 * error}
        still, scores = head_frame_of(trial.position_m), Scores(0.0, 0.0, 0.0, 1.0)
        made.append(CalibratedTrial(trial, still, 0.0, 1.0, scores, speeds, ()))
    return made


@given(errors=st.lists(st.floats(-0.05, 0.05), min_size=1, max_size=5))
@settings(max_examples=20, deadline=None)
def test_values_are_those_of_the_trials_and_intervals_are_in_order(errors: list[float]) -> None:
    found = speed_errors(trials(errors))

    assert list(found) == ["twin", "published"]
    assert speed_errors([]) == {}
    for name, factor in (("twin", 1), ("published", 2)):
        wanted = factor * np.array(errors)
        values = (np.abs(wanted).mean(), wanted.mean(), np.abs(wanted).max())
        assert [interval.value for interval in found[name]] == pytest.approx(values, abs=1e-12)
        for interval in found[name]:
            assert interval.low <= interval.high
