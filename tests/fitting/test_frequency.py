"""The swim frequency of tails whose beat is known, of the real ones, and the honesty of its standard error."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from fitting.frequency import estimate_frequency
from fitting.measure_trial import measure_trial
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.errors import NotEnoughData
from swimcal.robot import load_robot
from swimcal.session import TrialSpec
from swimcal.session_file import CameraSpec
from swimcal.tracks import load_tracks, markers_of, pixels_of
from tests.cases import changed, few, later
from tests.fitting.tails import noisy, tail
from tests.swimcal.sample import FISHSIM, needs_fishsim

REAL = ("f0_50", "f0_75", "f1_00", "f1_25", "f1_75")


@pytest.mark.parametrize("hz", [0.3, 0.55, 1.0, 1.7, 3.0])
@pytest.mark.parametrize("beats", [1.2, 2.0, 3.7, 10.0])
def test_a_clean_beat_is_found_whatever_its_speed_and_length(hz: float, beats: float) -> None:
    found = estimate_frequency(*tail(hz, beats))

    assert found.hz == pytest.approx(hz, rel=2e-4)
    assert found.beats == pytest.approx(beats, rel=0.02)
    assert found.explained > 0.999


@pytest.mark.parametrize(
    "harmonics",
    [(1.0, 0.45, 0.3), (1.0, 0.0, 0.5), (1.0, 0.6, 0.0), (0.7, 0.0, 0.0)],
    ids=["rich", "third", "second", "pure"],
)
@pytest.mark.parametrize("hz", [0.5, 1.1])
def test_harmonics_trap_it_neither_at_a_multiple_nor_at_a_fraction(hz: float, harmonics: tuple[float, ...]) -> None:
    boxes = noisy(tail(hz, 6.3, harmonics=harmonics), 0.8, np.random.default_rng(5))

    assert estimate_frequency(*boxes).hz == pytest.approx(hz, rel=0.01)
    assert estimate_frequency(*boxes, commanded_hz=2 * hz).hz == estimate_frequency(*boxes).hz


def test_outliers_nobody_flagged_are_tamed() -> None:
    clean = tail(0.8, 4.0)
    random = np.random.default_rng(2)
    boxes = noisy(clean, 0.8, random)
    hit = random.random(boxes.lateral_m.shape) < 0.03
    boxes.lateral_m[hit] += random.choice([-0.08, 0.08], hit.sum())

    assert estimate_frequency(*boxes).hz == pytest.approx(0.8, rel=0.005)


def test_phase_and_amplitude_are_those_of_the_last_marker() -> None:
    clean = tail(1.0, 5.0, harmonics=(1.0,))
    found = estimate_frequency(*clean)

    assert found.amplitude_m == pytest.approx(0.06, rel=1e-3)
    expected = found.amplitude_m * np.cos(2 * np.pi * clean.time_s + found.phase_rad)
    np.testing.assert_allclose(clean.lateral_m[:, 4], expected, atol=1e-4)


@pytest.mark.long
@pytest.mark.parametrize(("hz", "beats"), [(0.4, 1.6), (0.75, 2.8), (1.0, 5.0), (1.3, 6.5)])
@pytest.mark.parametrize("correlation", [0.8, 0.9, 0.95])
def test_its_interval_is_honest_for_trials_like_the_public_ones(hz: float, beats: float, correlation: float) -> None:
    clean = tail(hz, beats, drift=0.01)
    draws = [
        estimate_frequency(*noisy(clean, correlation, np.random.default_rng([seed, int(100 * correlation)])))
        for seed in range(400)
    ]

    assert 0.90 <= np.mean([abs(found.hz - hz) < 1.96 * found.se_hz for found in draws]) <= 0.99


def test_too_few_frames_have_no_standard_error() -> None:
    clean = tail(1.0, 1.5, fps=8.0)
    rows = np.arange(len(clean.time_s)) % 2 == 0
    weight = np.stack([rows, ~rows, rows, ~rows, rows], axis=1).astype(float)  # 7 frames a marker

    assert np.isnan(estimate_frequency(clean.time_s, clean.lateral_m, weight).se_hz)
    assert np.isfinite(estimate_frequency(*clean).se_hz)


def test_flags_say_what_is_doubtful() -> None:
    clean = tail(1.0, 4.0)
    assert estimate_frequency(*clean, commanded_hz=1.03).flags == ()

    (off,) = estimate_frequency(*clean, commanded_hz=1.25).flags
    assert off.kind == "frequency_off_command"
    assert "-20 % off the commanded 1.25 Hz" in off.message

    for commanded, unit in ((6.2, "rad/s"), (61.0, "turns a minute")):
        (off,) = estimate_frequency(*clean, commanded_hz=commanded).flags
        assert off.message.endswith(f"is commanded_hz in {unit}?")

    (few,) = estimate_frequency(*tail(1.0, 1.6)).flags
    assert few.kind == "few_beats"
    assert "1.6 beats" in few.message

    noise = clean._replace(lateral_m=np.random.default_rng(0).normal(0, 1e-3, clean.lateral_m.shape))
    assert [flag.kind for flag in estimate_frequency(*noise).flags] == ["unidentifiable"]


@few(5)
@given(beats=st.floats(2.1, 4.0), share=st.floats(0.01, 0.06), seed=st.integers(0, 999))
def test_white_noise_leaves_a_beat_clear_and_a_rest_does_not(beats: float, share: float, seed: int) -> None:
    time_s, lateral_m, weight = tail(1.0, beats)
    size_m = np.sqrt(share * (lateral_m**2).mean() / (1 - share))
    noise_m = np.random.default_rng(seed).normal(0.0, size_m, lateral_m.shape)
    rests = np.minimum(np.arange(len(time_s)), round(0.75 * len(time_s)))

    swims, halts = (
        estimate_frequency(time_s, seen, weight) for seen in (lateral_m + noise_m, (lateral_m + noise_m)[rests])
    )

    assert swims.flags == ()
    assert "few_beats" in {flag.kind for flag in halts.flags}


@few(5)
@given(seconds=st.floats(4.0, 25.0), lasts_s=st.floats(0.05, 20.0), order=st.integers(1, 2), seed=st.integers(0, 999))
def test_lasting_noise_has_no_clear_beat(seconds: float, lasts_s: float, order: int, seed: int) -> None:
    count, stays = round(30 * seconds), np.exp(-1 / (30 * lasts_s))
    series = np.random.default_rng(seed).normal(size=(count + 1500, 2))
    for _ in range(order):
        series = lfilter([1.0], [1.0, -stays], series, axis=0)
    with suppress(NotEnoughData):
        found = estimate_frequency(np.arange(count) / 30, 0.01 * series[1500:] / series.std(), np.ones((count, 2)))
        assert found.beats < 4.0 or not found.clear


@pytest.mark.parametrize(
    ("frames", "size", "weight", "message"),
    [
        (30, 1.0, 1.0, "hold 0.[0-9]+ beats"),
        (300, 1.0, 0.0, "fewer than 12 frames"),
        (300, 0.0, 1.0, "does not move"),
    ],
)
def test_less_than_a_beat_is_refused(frames: int, size: float, weight: float, message: str) -> None:
    time_s, lateral_m, ones = (series[:frames] for series in tail(0.4, 3.0))

    with pytest.raises(NotEnoughData, match=message):
        estimate_frequency(time_s, size * lateral_m, weight * ones)


def crossings_hz(tracks: xr.Dataset) -> float:
    """The beat of the caudal fin by another road: a line through the times at which it crosses the body's axis."""
    nose, neck, fin = (pixels_of(tracks)[:, markers_of(tracks).index(name)] for name in ("nose", "neck", "caudal_fin"))
    axis = (neck - nose) / np.linalg.norm(neck - nose, axis=1, keepdims=True)
    lateral = (fin - nose)[:, 0] * axis[:, 1] - (fin - nose)[:, 1] * axis[:, 0]
    lateral = np.convolve(np.pad(lateral, 6, mode="edge"), np.hanning(15)[1:-1] / np.hanning(15).sum(), mode="valid")
    lateral = lateral - (lateral.max() + lateral.min()) / 2
    before = np.flatnonzero(np.diff(np.sign(lateral)) != 0)
    share = lateral[before] / (lateral[before] - lateral[before + 1])
    times = tracks.time.values[before] + share * np.diff(tracks.time.values)[before]
    number, rising = np.arange(len(times)), (np.arange(len(times)) % 2).astype(float)
    line = np.linalg.lstsq(np.column_stack([np.ones_like(times), rising, number]), times, rcond=None)[0]
    return float(0.5 / line[2])


def real(name: str) -> xr.Dataset:
    return load_tracks(FISHSIM / f"{name}.csv", FISHSIM_MARKERS, 60.0)


def measured_hz(tracks: xr.Dataset, name: str) -> float:
    camera = CameraSpec(fps=60.0, scale_length_m=0.142, calibration=None, file=None)
    spec = TrialSpec(name, "swim", commanded_hz=float(name[1:].replace("_", ".")))
    return measure_trial(spec, tracks, camera, load_robot(), 1.0).frequency.hz


@needs_fishsim
@pytest.mark.parametrize("name", REAL)
def test_every_real_trial_beats_as_often_as_its_fin_crosses_the_axis(name: str) -> None:
    assert measured_hz(real(name), name) == pytest.approx(crossings_hz(real(name)), rel=0.01)


@needs_fishsim
@pytest.mark.parametrize("name", [*REAL[:2], *later(*REAL[2:])])
def test_faults_put_into_real_tracks_do_not_change_their_beat(name: str) -> None:
    tracks = real(name)
    position_px, place = pixels_of(tracks).copy(), markers_of(tracks).index
    position_px[40:90, place("caudal_fin")] = position_px[40, place("caudal_fin")]
    position_px[100:220, place("tail_3")] = position_px[100:220, place("tail_4")] + [1.5, -1.0]
    position_px[200:206, place("tail_5")] += [80.0, -60.0]
    position_px[230:255, place("tail_4")] = np.nan
    confidence = np.isfinite(position_px).all(axis=2).astype(float)
    faulty = changed(tracks, position_px=position_px, confidence=confidence)

    assert measured_hz(faulty, name) == pytest.approx(measured_hz(tracks, name), rel=0.01)
