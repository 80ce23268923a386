"""A measured swim: what is known of a held-out one, what is compared, where it starts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from fitting.measure_trial import measure_trial
from fitting.phase import fit_phase
from fitting.published import Swims
from fitting.trial import MeasuredTrial
from swimcal.errors import NotEnoughData
from swimcal.robot import load_robot
from swimcal.session import Session, load_session
from swimcal.session_file import CameraSpec
from swimcal.tracks import load_tracks, markers_of, pixels_of
from swimsynth.session import Truth, make_session
from tests.cases import changed
from tests.fitting.swims import PLAN
from tests.tracking.lens.render import lens_of, to_pixels
from tracking.camera import to_pool

LENS = lens_of(
    (3840, 2160), (2280.0, 2280.0), (1919.5, 1079.5), -0.05, 0.02, 0.0, 0.0, -0.003, height_above_water_m=2.4
)


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Session:
    return load_session(make_session(tmp_path_factory.mktemp("trial") / "session", PLAN))


def tracks_of(session: Session, name: str) -> xr.Dataset:
    path = session.trial(name).tracks
    assert path is not None
    return load_tracks(path, session.markers, session.camera.fps)


def measured(session: Session, name: str, tracks: xr.Dataset | None = None, **changes: object) -> MeasuredTrial:
    spec = replace(session.trial(name), **changes)  # type: ignore[arg-type]
    return measure_trial(spec, tracks or tracks_of(session, name), session.camera, load_robot(), session.warmup_s)


def first_frames(tracks: xr.Dataset, seconds: float) -> xr.Dataset:
    kept = tracks.time.values <= seconds + 1e-9
    return tracks.isel(time=kept)


def test_a_fit_trial_knows_all_of_itself_and_is_scored_for_4_s(session: Session) -> None:
    trial = measured(session, "new", role="fit")

    assert trial.known.all()
    assert trial.start_frequency == trial.frequency
    np.testing.assert_array_equal(trial.kept, trial.time_s >= 1.0 - 1e-9)
    assert trial.time_s[trial.scored][[0, -1]] == pytest.approx([1.0, 5.0 - 1 / 60], abs=1e-6)


def test_a_held_out_trial_knows_two_beats_and_is_scored_on_the_rest(session: Session) -> None:
    trial = measured(session, "new")

    assert trial.time_s[trial.known][-1] == pytest.approx(2.0, abs=0.05)
    assert not (trial.known & trial.kept).any()
    assert (trial.known | trial.kept).all()
    np.testing.assert_array_equal(trial.scored, trial.kept)


def without(session: Session, marker: str, first_s: float, last_s: float) -> xr.Dataset:
    """The tracks of the held-out trial, in which a marker is missing for a while."""
    tracks = tracks_of(session, "new")
    confidence = tracks.confidence.values.copy()
    missing = (tracks.time.values >= first_s) & (tracks.time.values <= last_s)
    confidence[missing, markers_of(tracks).index(marker)] = 0.0
    return changed(tracks, confidence=confidence)


@pytest.mark.parametrize("marker", ["nose", "neck"])
def test_frames_without_a_head_are_no_known_beats(session: Session, marker: str) -> None:
    """The known part grows by them; what it shows too little of is flagged, and less than a beat is refused."""
    whole, gappy = measured(session, "new"), measured(session, "new", without(session, marker, 0.5, 0.8))
    assert gappy.time_s[gappy.known][-1] == pytest.approx(whole.time_s[whole.known][-1] + 0.32, abs=0.05)
    assert gappy.start_frequency.hz == pytest.approx(whole.start_frequency.hz, rel=5e-3)
    assert gappy.time_s[gappy.aligned] == pytest.approx(gappy.time_s[gappy.known][-1] + 1 / 60)

    little = measured(session, "new", without(session, marker, 1.4, 2.6))
    assert [flag for flag in little.flags if "only 1.4 beats" in flag.message and not flag.markers]
    between = measured(session, "new", without(session, marker, 1.1, 2.1))
    assert [flag for flag in between.flags if "only 1.5 beats" in flag.message and not flag.markers]
    assert not [flag for flag in gappy.flags if flag.kind == "few_beats"]


@pytest.mark.parametrize(("first_s", "last_s"), [(0.6, 2.6), (0.3, 2.2), (0.0, 1.9), (0.2, 1.5)])
def test_a_known_part_that_shows_less_than_a_beat_is_refused(session: Session, first_s: float, last_s: float) -> None:
    with pytest.raises(NotEnoughData, match="held-out trial that may be looked at"):
        measured(session, "new", without(session, "neck", first_s, last_s))


@pytest.mark.parametrize("seconds", [5.0, 3.0])
def test_nothing_held_out_is_taken_from_the_frames_it_is_scored_on(
    session: Session, swims: Swims, truth: Truth, seconds: float
) -> None:
    """Its rest is replaced by another swim, of another speed and heading, joined to it without a jump."""
    true = first_frames(tracks_of(session, "new"), seconds)
    fast = pixels_of(tracks_of(session, "fast"))
    trial = measured(session, "new", true)
    count = int(trial.known.sum())
    position_px = pixels_of(true).copy()
    length = len(position_px) - count
    rest = np.resize(fast, (length, *fast.shape[1:]))
    share = np.clip(np.arange(length) / 12, 0, 1)[:, None, None]  # a sudden change would be a jump of the whole body
    position_px[count:] += share * (rest + position_px[count - 1, 0] - rest[0, 0] - position_px[count:])
    other = measured(session, "new", changed(true, position_px=position_px))

    assert (other.weight[:count] == trial.weight[:count]).all()
    np.testing.assert_array_equal(other.known, trial.known)
    assert other.start_frequency.hz == pytest.approx(trial.start_frequency.hz, rel=1e-6)
    np.testing.assert_allclose(other.start_velocity, trial.start_velocity, atol=1e-6)
    phases = [fit_phase(swims.twin, one, truth.plan.coefficients) for one in (trial, other)]
    assert phases[0] == pytest.approx(phases[1], abs=1e-6)


@pytest.mark.parametrize("name", ["slow", "fast", "new"])
def test_start_speed_and_frequency_are_the_true_ones(name: str, trials: dict[str, MeasuredTrial], truth: Truth) -> None:
    trial = trials[name]

    assert -trial.start_velocity[0] == pytest.approx(truth.trials[name].speed_m_s, abs=0.06)
    step = np.gradient(trial.head.path_m, trial.time_s, axis=0)[1]
    np.testing.assert_allclose(trial.start_velocity[:2], step, atol=0.03)
    assert trial.frequency.hz == pytest.approx(truth.trials[name].frequency_hz, rel=1e-3)
    if name != "new":  # kept frames differ for a held-out trial
        assert trial.speed == pytest.approx(truth.trials[name].speed_m_s, rel=5e-3)


def test_frames_without_a_trusted_head_count_for_no_marker(session: Session) -> None:
    tracks = tracks_of(session, "slow")
    confidence = tracks.confidence.values.copy()
    confidence[50:60, markers_of(tracks).index("neck")] = 0.0
    trial = measured(session, "slow", changed(tracks, confidence=confidence))

    assert not trial.weight[50:60].any()
    assert (trial.weight[:50] > 0).all()


def distrusted(tracks: xr.Dataset) -> xr.Dataset:
    return changed(tracks, confidence=np.where(np.arange(len(markers_of(tracks))) < 3, tracks.confidence.values, 0.0))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda tracks: first_frames(tracks, 1.1), r"trial fast: 1.10 s leave .* needed: shorten \[fit\] warmup_s"),
        (
            lambda tracks: tracks.sel(keypoint=["nose", "neck", "dorsal_fin"]),
            "trial fast: none of its markers sits on the tail",
        ),
        (distrusted, "fewer than 12 frames with a usable tail marker"),
    ],
)
def test_a_trial_that_shows_too_little_is_refused(
    session: Session, change: Callable[[xr.Dataset], xr.Dataset], message: str
) -> None:
    with pytest.raises(NotEnoughData, match=message):
        measured(session, "fast", change(tracks_of(session, "fast")))


def test_the_camera_sets_the_scale(session: Session) -> None:
    far = CameraSpec(60.0, 2 * session.camera.scale_length_m, None, None)
    near = measured(session, "slow")
    double = measure_trial(session.trial("slow"), tracks_of(session, "slow"), far, load_robot(), 1.0)

    assert double.speed == pytest.approx(2 * near.speed)
    assert double.metres_per_px == pytest.approx(2 * near.metres_per_px)


def test_stamps_win_over_a_frame_rate_that_is_a_little_off(session: Session) -> None:
    """The stamps are 60 a second."""
    camera = replace(session.camera, fps=59.94)
    found = measured(replace(session, camera=camera), "slow", tracks_of(session, "slow"))
    assert found.frequency.hz == measured(session, "slow").frequency.hz


@pytest.mark.parametrize("fps", [30.0, 56.0, 64.0, 120.0])
def test_stamps_of_another_frame_rate_are_refused(session: Session, fps: float) -> None:
    camera = replace(session.camera, fps=fps)
    with pytest.raises(NotEnoughData, match="its time stamps give 60 frames a second"):
        measured(replace(session, camera=camera), "slow", tracks_of(session, "slow"))


def test_lens_and_heights_of_the_markers_are_undone(session: Session) -> None:
    robot, flat = load_robot(), tracks_of(session, "fast")
    true = to_pool(flat, session.camera)[0]
    above_m = robot.marker_positions_m(markers_of(flat))[:, 2] - robot.markers["nose"].position_m[2]  # (m,)
    ray = (true - np.nanmean(true, axis=(0, 1))) * [1, -1] / (2.4 - above_m)[:, None]
    filmed = changed(flat, position_px=to_pixels(ray, LENS))

    expected = measured(session, "fast")
    camera = replace(session.camera, calibration=LENS)
    found = measured(replace(session, camera=camera), "fast", filmed)

    assert found.head.shape_m == pytest.approx(expected.head.shape_m, abs=1e-6)
    assert found.speed == pytest.approx(expected.speed, abs=1e-6)
