"""Features holds speed and beat, whatever course the fish takes and wherever its crank began."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fitting.features import COURSE, SPEED, FeatureReader, advance_phase, harmonics_of, phase_between, places_of_slides
from fitting.trial import MeasuredTrial
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.runs import Runs
from swimsynth.plan import PLAUSIBLE_COEFFICIENTS
from tests.fitting.exact_swims import exact_twin
from tests.fitting.posterior.waves import (
    ALONG_M,
    AMPLITUDE_M,
    LAG_RAD,
    SPEED_M_S,
    TIME_S,
    cruising,
    pool,
    reader,
    shape,
)
from tests.swimcal.sample import needs_fishsim


def test_a_wave_of_known_size_and_lag_has_its_harmonics() -> None:
    features = reader()(cruising())
    across = harmonics_of(features)[:, 1]  # (m, 3)
    assert features[SPEED] == pytest.approx(SPEED_M_S)
    assert across[:, 0] == pytest.approx(AMPLITUDE_M * np.exp(-1j * LAG_RAD), abs=1e-9)
    assert across[:, 1] == pytest.approx(0.0, abs=1e-9)
    assert across[:, 2] == pytest.approx(-0.1j * AMPLITUDE_M, abs=1e-9)
    assert harmonics_of(features)[:, 0] == pytest.approx(0.0, abs=1e-9)
    means = features[1:].reshape(-1, 2, 7)[..., 0]
    assert means[:, 0] - means[0, 0] == pytest.approx(-ALONG_M)
    assert means[:, 1] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("heading_rad", [0.3, 2.0, 3.1, -2.5])
def test_a_pool_that_is_turned_and_shifted_shows_the_same_features(heading_rad: float) -> None:
    straight = cruising() @ [1.0, 1j]
    turned = pool(straight * np.exp(1j * heading_rad) + 2.0 - 1.5j)
    assert reader()(turned) == pytest.approx(reader()(cruising()), abs=1e-10)


def test_the_course_is_how_fast_it_slips_and_turns() -> None:
    slip, turning = 0.03, 0.15
    heading = 2.5 + turning * TIME_S
    path = np.cumsum((SPEED_M_S + 1j * slip) * np.exp(1j * (heading - turning / 120)) / 60)
    bent = pool(path[:, None] + (shape() + ALONG_M.mean()) * np.exp(1j * heading)[:, None])
    read = replace(reader(), span_m=float(ALONG_M[1]))

    features = read(bent)

    plain, slides = reader()(bent), places_of_slides(len(features))
    assert features[-len(COURSE) :] == pytest.approx([slip, turning], abs=1e-4)
    assert features[: len(plain)] == pytest.approx(plain)
    assert (slides.start, slides.stop) == (len(plain), len(plain) + len(ALONG_M))
    assert features[slides] == pytest.approx(0.0, abs=2e-4)
    assert advance_phase(features, 0.7)[len(plain) :] == pytest.approx(features[len(plain) :])
    assert advance_phase(features, 0.7)[: len(plain)] == pytest.approx(advance_phase(plain, 0.7))
    assert phase_between(features, advance_phase(features, 0.7), [4, 5, 6]) == pytest.approx(0.7)


def test_a_marker_creeps_aside_of_its_neighbours_whatever_course_the_fish_takes() -> None:
    """Not where all turn together; nose, neck and the ends are not judged, nor is a marker that is not seen."""
    pace, own, turning = 0.004, 4, 0.1
    heading = 0.8 + turning * TIME_S
    along = cruising() @ [1.0, 1j]
    creeping = along + 1j * pace * (TIME_S - TIME_S.mean())[:, None] * (np.arange(len(ALONG_M)) == own)
    usable = np.ones(along.shape, bool)
    usable[:, 5] = False

    found = reader(usable).creeps(pool(np.stack([along, creeping]) * np.exp(1j * heading)[:, None]), ALONG_M)

    assert found[0] == pytest.approx(0.0, abs=5e-5)
    assert found[1, own] == pytest.approx(pace, rel=0.02)
    assert not found[1, [0, 1, 5, len(ALONG_M) - 1]].any()
    near = (ALONG_M[3] - ALONG_M[2]) / (ALONG_M[own] - ALONG_M[2])  # share of the creeping neighbour in the line
    assert found[1, 3] == pytest.approx(-near * pace, rel=0.05)


def test_an_advanced_features_is_that_of_a_simulation_with_another_phase() -> None:
    ahead, hz = np.array([0.0, 0.4, -1.1]), 1.0
    time_s = np.arange(0.0, 9.0, 1 / 60)
    runs = Runs(np.tile(PLAUSIBLE_COEFFICIENTS, (3, 1)), np.full(3, hz), 1.0 + ahead, np.tile([-0.15, 0, 0], (3, 1)))
    twin, late = exact_twin(), time_s >= 5.0
    nose, neck = twin.markers.index("nose"), twin.markers.index("neck")
    read = FeatureReader(
        time_s[late], 2 * np.pi * hz * time_s[late], np.ones((int(late.sum()), len(twin.markers)), bool), nose, neck
    )
    features = read(twin.simulate(runs, time_s).marker_m[:, late])
    expected = advance_phase(np.tile(features[0], (2, 1)), ahead[1:])
    assert harmonics_of(features[1:]) == pytest.approx(harmonics_of(expected), abs=2e-4)
    assert np.abs(harmonics_of(features[1:]) - harmonics_of(features[0])).max() > 5e-3
    tail = list(range(3, len(twin.markers)))
    assert phase_between(np.tile(features[0], (2, 1)), features[1], tail)[0] == pytest.approx(0.4, abs=5e-3)


TAIL = slice(3, 8)


@pytest.mark.long
@needs_fishsim
def test_high_markers_run_ahead_and_the_tail_falls_behind(public: list[MeasuredTrial]) -> None:
    found = []  # by which share of a trial's speed each marker slides forward
    for trial in (each.with_role("fit") for each in public if each.name != "f0_50"):  # at 20 mm/s, too slowly to tell
        features = FeatureReader.of(trial, with_course=True)(trial.position_m[trial.kept])
        found.append(features[places_of_slides(len(features))] / features[0])
    over_speed = np.array(found)  # (t, 9)
    dorsal, caudal = (FISHSIM_MARKERS.index(name) for name in ("dorsal_fin", "caudal_fin"))
    assert (over_speed[:, [dorsal, caudal]] > 0.012).all()
    assert (over_speed[:, TAIL].mean(axis=1) < -0.01).all()
    assert np.corrcoef(over_speed).min() > 0.85
