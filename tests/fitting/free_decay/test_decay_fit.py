"""Stiffness and damping are recovered from wrong starts, and doubtful decays say so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from fitting.decay_fit import fit_decay
from fitting.free_decay import DecayTrial, measure_decay_trial
from fitting.hinges import DecayFit, combine_decays
from swimcal.errors import NotEnoughData
from swimcal.tracks import pixels_of
from swimsynth.disturbances import NOISELESS
from tests.cases import later
from tests.fitting.free_decay.chain import linear_decay, natural_hz
from tests.fitting.free_decay.decays import CAMERA, MARKERS, ROBOT, Truth, decay_tracks, filmed, swings

LIGHT = Truth(stiffness_n_m=0.45, damping_n_m_s=0.006, seconds=2.2)


def measured(tracks: xr.Dataset) -> DecayTrial:
    return measure_decay_trial("decay", tracks, CAMERA, ROBOT)


def fitted(tracks: xr.Dataset) -> DecayFit:
    return fit_decay(measured(tracks), ROBOT, workers=1)


def kinds(fit: DecayFit) -> set[str]:
    return {flag.kind for flag in fit.flags}


@pytest.fixture(scope="module")
def light() -> DecayFit:
    return fitted(decay_tracks(LIGHT))


@pytest.mark.parametrize("truth", [Truth(), *later(Truth(0.3, 0.01)), Truth(1.4, 0.03)])
def test_without_noise_the_hinges_are_recovered_from_a_wrong_start(truth: Truth) -> None:
    fit = fitted(decay_tracks(truth, noise=NOISELESS))

    assert fit.stiffness_n_m == pytest.approx(truth.stiffness_n_m, rel=2e-3)
    assert fit.damping_n_m_s == pytest.approx(truth.damping_n_m_s, rel=2e-3)
    assert fit.start_rad.shape == (2, 5)


def test_through_tracking_noise_the_hinges_and_the_spectrum_are_right(light: DecayFit) -> None:
    spectrum = light.spectrum

    assert spectrum.peak_hz == pytest.approx(natural_hz(ROBOT, LIGHT.stiffness_n_m)[0], rel=0.05)
    assert spectrum.amplitude_m.shape == (len(spectrum.bins_hz), 6)
    assert light.flags == ()
    assert light.converged
    assert light.stiffness_n_m == pytest.approx(LIGHT.stiffness_n_m, rel=0.01)
    assert light.damping_n_m_s == pytest.approx(LIGHT.damping_n_m_s, rel=0.10)
    assert light.explained > 0.99
    assert np.nanstd(light.measured_m - light.simulated_m) < 0.001
    assert light.matched_stiffness_n_m == pytest.approx(light.stiffness_n_m, rel=0.05)


def test_a_decay_of_the_linear_chain_gives_its_stiffness_back() -> None:
    truth = replace(LIGHT, bent_rad=(0.04, 0.05, 0.04, 0.03, 0.02))
    times = np.maximum(np.arange(120) / 60 - truth.release_s, 0.0)
    hinges = linear_decay(ROBOT, truth.stiffness_n_m, truth.damping_n_m_s, np.array(truth.bent_rad), times)
    place = ROBOT.marker_positions_m(MARKERS)[None, :, :2].repeat(len(times), axis=0).copy()
    lever = ROBOT.marker_positions_m(MARKERS)[:, 0, None] - ROBOT.hinge_x_m  # (m, h), of hinges before the marker
    place[..., 1] += hinges @ np.maximum(lever, 0.0).T

    fit = fitted(filmed(place, replace(truth, seconds=2.0), noise=NOISELESS))

    assert fit.stiffness_n_m == pytest.approx(truth.stiffness_n_m, rel=3e-3)
    assert fit.damping_n_m_s == pytest.approx(truth.damping_n_m_s, rel=1e-2)


@pytest.mark.parametrize(
    ("frames", "marker", "off_px", "kind"),
    [
        (slice(50, 53), 7, [0.0, 12.0], "jump"),
        (slice(35, 55), 8, np.nan, "clipped"),
        *later((slice(None), 5, np.nan, "clipped")),
    ],
)
def test_samples_out_of_place_or_sight_are_left_out_and_reported(
    frames: slice, marker: int, off_px: float | list[float], kind: str
) -> None:
    tracks = decay_tracks(LIGHT)
    pixels_of(tracks)[frames, marker] += off_px

    fit = fitted(tracks)

    assert fit.stiffness_n_m == pytest.approx(LIGHT.stiffness_n_m, rel=0.02)
    assert [flag.markers for flag in fit.flags if flag.kind == kind] == [(MARKERS[marker],)]


@pytest.mark.parametrize(
    ("truth", "kind"),
    [(replace(LIGHT, damping_n_m_s=0.09), "unidentifiable"), (replace(LIGHT, seconds=0.85), "too_short")],
)
def test_creeping_tails_and_short_recordings_are_flagged(truth: Truth, kind: str) -> None:
    assert kind in kinds(fitted(decay_tracks(truth)))


@pytest.mark.long
def test_two_frequencies_are_double_peaked_and_do_not_fit() -> None:
    place = swings([LIGHT])[0]
    clock = np.maximum(np.arange(len(place)) / 60 - LIGHT.release_s, 0.0)
    beat = 0.04 * np.sin(2 * np.pi * 7.0 * clock) * np.exp(-0.8 * clock)
    place[:, 3:, 1] += beat[:, None] * np.linspace(0.3, 1.0, 6)

    found = kinds(fitted(filmed(place, LIGHT)))

    assert {"double_peaked", "poor_fit"} <= found


def test_a_head_that_swings_along_is_not_clamped() -> None:
    tracks = decay_tracks(LIGHT)
    pixels_of(tracks)[:, :, 1] += 8.0 * np.sin(20 * tracks.time.values)[:, None]

    assert "head_moves" in {flag.kind for flag in measured(tracks).flags}


@pytest.mark.parametrize(
    ("seconds", "markers", "message"),
    [
        (2.2, ("nose", "neck", "dorsal_fin"), "none of its markers sits on the tail"),
        (0.62, MARKERS, "frames after the release"),
    ],
)
def test_a_decay_that_shows_too_little_is_refused(seconds: float, markers: tuple[str, ...], message: str) -> None:
    with pytest.raises(NotEnoughData, match=message):
        measured(decay_tracks(replace(LIGHT, seconds=seconds)).sel(keypoint=list(markers)))


def test_several_decays_weigh_by_their_errors_and_may_disagree(light: DecayFit) -> None:
    off = replace(light, name="other", stiffness_n_m=1.1 * light.stiffness_n_m)

    alike, apart = combine_decays([light, light]), combine_decays([light, off])

    assert alike.stiffness_n_m == pytest.approx(light.stiffness_n_m)
    assert alike.stiffness_se_n_m == pytest.approx(light.stiffness_se_n_m / np.sqrt(2))
    assert alike.flags == ()
    assert apart.stiffness_se_n_m > 5 * alike.stiffness_se_n_m
    (flag,) = apart.flags
    assert flag.kind == "decays_disagree"
    assert f"{light.name} {light.stiffness_n_m:.3g} ± " in flag.message
    assert f"other {off.stiffness_n_m:.3g} ± " in flag.message
    with pytest.raises(NotEnoughData, match="at least one"):
        combine_decays([])
