"""A swim trial is judged before any fit: what it lacks is flagged or ends it, and what it shows counts as it is."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fitting.frequency import beating_part
from fitting.measure_trial import measure_trial
from fitting.pool import determined, smooth_swim
from fitting.trial import MeasuredTrial
from fitting.trial_checks import sight_flags
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.errors import NotEnoughData
from swimcal.robot import load_robot
from swimcal.session import TrialSpec
from swimcal.session_file import CameraSpec
from swimcal.tracks import as_tracks
from tests.cases import few
from tests.fitting.exact_swims import lasting_noise

ROBOT, CAMERA, FPS = load_robot(), CameraSpec(60.0, 0.142), 60.0
PX_PER_M = 950.0


def swim(
    seconds: float = 5.0,
    hz: float = 1.0,
    speed: float = 0.1,
    fps: float = FPS,
    turning: float = 0.0,
    grows: float = 0.0,
    noise_px: float = 0.3,
    seed: int = 0,
) -> tuple[np.ndarray, np.ndarray]:
    """Times (n,), s, and pixels (n, m, 2) of a fish whose tail waves behind a head that sways and yaws a little."""
    time_s = np.arange(round(seconds * fps)) / fps
    along = ROBOT.marker_positions_m(FISHSIM_MARKERS)[:, 0] - ROBOT.markers["nose"].position_m[0]
    beat, behind = 2 * np.pi * hz * time_s[:, None], np.clip((along - 0.25) / 0.3, 0.0, 1.0)
    across = 0.06 * behind * np.sin(beat - 3.0 * along) + 0.004 * np.sin(beat)
    body = along + 1j * (across + along * 0.06 * np.sin(beat + 1.0))
    course = turning * time_s
    path = -np.concatenate([[0], np.cumsum(np.exp(1j * course[1:]) * speed / fps)])
    place = path[:, None] + body * np.exp(1j * course)[:, None]
    place = place * (1 + grows * time_s / time_s[-1])[:, None]
    position_px = np.stack([place.real, -place.imag], axis=-1) * PX_PER_M + 1500.0
    return time_s, position_px + np.random.default_rng(seed).normal(0.0, noise_px, position_px.shape)


def measured(
    time_s: np.ndarray, position_px: np.ndarray, role: str = "fit", markers: tuple[str, ...] = FISHSIM_MARKERS
) -> MeasuredTrial:
    tracks = as_tracks(markers, time_s, position_px, np.isfinite(position_px).all(axis=-1).astype(float))
    camera = replace(CAMERA, fps=1 / float(np.median(np.diff(time_s))))
    return measure_trial(TrialSpec("trial", "swim", role=role), tracks, camera, ROBOT, 1.0)


def kinds(trial: MeasuredTrial) -> set[str]:
    return {flag.kind for flag in trial.flags if not flag.markers}


def lose(position_px: np.ndarray, names: tuple[str, ...], frames: slice | np.ndarray) -> np.ndarray:
    found = position_px.copy()
    for name in names:
        found[frames, FISHSIM_MARKERS.index(name)] = np.nan
    return found


def test_a_clean_swim_has_no_flag_and_its_true_speed() -> None:
    trial = measured(*swim())

    assert kinds(trial) == set()
    assert trial.speed == pytest.approx(0.1, rel=2e-3)
    assert trial.frequency.hz == pytest.approx(1.0, rel=2e-3)


@few(3)
@given(
    hz=st.floats(0.5, 2.5),
    fps=st.sampled_from([25.0, 30.0, 50.0, 60.0, 120.0]),
    turn=st.floats(-3.1, 3.1),
    mirrored=st.booleans(),
    seed=st.integers(0, 1000),
)
def test_how_it_was_filmed_does_not_matter(hz: float, fps: float, turn: float, mirrored: bool, seed: int) -> None:
    time_s, position_px = swim(hz=hz, fps=fps, noise_px=0.1, seed=seed)
    cos, sin = np.cos(turn), np.sin(turn)
    laid = position_px @ np.array([[cos, sin], [-sin, cos]]) * [1, -1 if mirrored else 1]
    trial, other = measured(time_s, position_px), measured(time_s, laid)

    assert other.speed == pytest.approx(trial.speed, rel=1e-4)
    assert other.frequency.hz == pytest.approx(trial.frequency.hz, rel=1e-5)
    assert trial.speed == pytest.approx(0.1, rel=5e-3)
    assert kinds(trial) == kinds(other) == set()


@pytest.mark.parametrize("role", ["fit", "holdout"])
@pytest.mark.parametrize(("before_s", "after_s"), [(2.0, 0.0), (0.0, 2.5), (1.5, 1.5)])
def test_rest_is_left_out(role: str, before_s: float, after_s: float) -> None:
    _, swum = swim(seconds=7.0)
    random = np.random.default_rng(3)
    parts = [
        swum[:1] + random.normal(0, 0.3, (round(before_s * FPS), *swum.shape[1:])),
        swum,
        swum[-1:] + random.normal(0, 0.3, (round(after_s * FPS), *swum.shape[1:])),
    ]
    position_px = np.concatenate(parts)
    trial = measured(np.arange(len(position_px)) / FPS, position_px, role)

    assert "rests" in kinds(trial)
    assert trial.frequency.hz == pytest.approx(1.0, rel=5e-3)
    assert trial.speed == pytest.approx(0.1, rel=0.01)
    assert trial.first_frame >= (before_s > 0) * (before_s - 0.6) * FPS


@few(3)
@given(
    hz=st.floats(0.4, 2.0),
    beats=st.floats(0.3, 1.2),
    first=st.booleans(),
    role=st.sampled_from(["fit", "holdout"]),
    seed=st.integers(0, 1000),
)
def test_a_rest_of_less_than_a_beat_does_not_slow_the_fish(
    hz: float, beats: float, first: bool, role: str, seed: int
) -> None:
    _, swum = swim(seconds=6.0 / hz + 1.0, hz=hz, seed=seed)
    noise = np.random.default_rng(seed).normal(0.0, 0.3, (round(beats / hz * FPS), *swum.shape[1:]))
    position_px = np.concatenate([swum[:1] + noise, swum] if first else [swum, swum[-1:] + noise])
    trial = measured(np.arange(len(position_px)) / FPS, position_px, role)
    assert len(trial.time_s) == pytest.approx(len(swum), abs=0.15 * FPS / hz)
    assert trial.first_frame == pytest.approx(len(noise) if first else 0, abs=0.15 * FPS / hz)
    assert trial.speed == pytest.approx(0.1, rel=0.03)
    assert trial.frequency.hz == pytest.approx(hz, rel=0.01)
    assert trial.start_velocity[0] == pytest.approx(-0.1, abs=0.01)


@few(3)
@given(
    seed=st.integers(0, 10_000),
    noise_px=st.floats(0.1, 6.0),
    lasting=st.sampled_from([0.0, 0.9, 0.97, 0.99, 0.997]),
    seconds=st.floats(3.0, 20.0),
)
def test_a_robot_at_rest_has_no_beat(seed: int, noise_px: float, lasting: float, seconds: float) -> None:
    time_s, swum = swim(seconds)
    noise = np.random.default_rng(seed).normal(0.0, noise_px, swum.shape)
    for frame in range(1, len(noise)):
        noise[frame] = lasting * noise[frame - 1] + np.sqrt(1 - lasting**2) * noise[frame]

    with pytest.raises(NotEnoughData, match=r"no lasting beat|does not move|beats at|are needed|usable"):
        measured(time_s, swum[:1] + noise)


def test_a_rest_among_few_beats_is_flagged() -> None:
    """Too few to find the rest itself."""
    _, swum = swim(seconds=2.5)
    rest = np.repeat(swum[-1:], round(0.5 * FPS), axis=0)
    rest = rest + np.random.default_rng(5).normal(0.0, 0.3, rest.shape)
    position_px = np.concatenate([swum, rest])
    trial = measured(np.arange(len(position_px)) / FPS, position_px)
    assert {"few_beats", "rests"} & kinds(trial)
    assert not {"few_beats", "rests"} & kinds(measured(*swim(seconds=3.2)))


def test_a_clear_beat_may_be_small() -> None:
    """Of 1 % of the length, without lasting noise: a robot of few links beats so."""
    time_s, position_px = swim(seconds=9.0)
    still = position_px.mean(axis=0) - position_px[..., :1, :].mean(axis=0)
    small = position_px[:, :1] + still + 0.15 * (position_px - position_px[:, :1] - still)
    assert measured(time_s, small).frequency.hz == pytest.approx(1.0, rel=5e-3)


def test_near_its_root_a_tail_hardly_swings() -> None:
    """A clear beat of less than 0.4 % of the length is one, where no marker sits further back."""
    names = ("nose", "neck", "tail_1")
    time_s, position_px = swim(seconds=9.0, noise_px=0.05)
    seen = position_px[:, [FISHSIM_MARKERS.index(name) for name in names]]
    rigid = seen[:, :1] + (seen[:, 1:2] - seen[:, :1]) * (0.2995 / 0.142)
    seen[:, 2:] = rigid + 0.0015 * PX_PER_M * np.array([0.0, 1.0]) * np.sin(2 * np.pi * time_s)[:, None, None]
    trial = measured(time_s, seen, markers=names)
    assert trial.frequency.hz == pytest.approx(1.0, rel=5e-3)
    assert 0.001 < trial.frequency.swing_m < 0.004 * ROBOT.length_m


def test_a_fish_that_leaves_the_picture_does_not_stand_still() -> None:
    time_s, position_px = swim(seconds=8.0)
    trial = measured(time_s, lose(position_px, FISHSIM_MARKERS, slice(300, None)))

    assert "leaves_picture" in kinds(trial)
    assert trial.speed == pytest.approx(0.1, rel=3e-3)
    assert trial.time_s[trial.kept][-1] < 5.0


@few(3)
@given(
    hz=st.floats(0.5, 1.6),
    first=st.integers(9, 480),
    copies=st.integers(1, 8),
    stopped=st.booleans(),
    role=st.sampled_from(["fit", "holdout"]),
)
def test_a_film_that_stands_still_for_a_moment_is_told(
    hz: float, first: int, copies: int, stopped: bool, role: str
) -> None:
    """Whether the robot went on meanwhile or the film was stopped; only what is still right counts."""
    time_s, true = swim(seconds=9.0, hz=hz)
    after = true[first : len(true) - copies] if stopped else true[first + copies :]
    trial = measured(
        time_s, np.concatenate([true[:first], np.repeat(true[first - 1 : first], copies, axis=0), after]), role
    )
    assert {flag.kind for flag in trial.flags} & {"frozen_marker", "repeated_frames"}
    assert trial.speed == pytest.approx(0.1, rel=0.03)
    assert trial.frequency.hz == pytest.approx(hz, rel=1e-3 + (copies < 3) * stopped * 0.01)


@pytest.mark.parametrize(
    "frames",
    [slice(60, None), slice(None, -8), slice(180, None), np.sin(2 * np.pi * np.arange(300) / 60.0) > 0],
    ids=["never after the warm-up", "in 8 frames", "in 2 beats of 5", "on one side of every beat"],
)
def test_a_marker_that_is_hardly_seen_takes_no_part(frames: slice | np.ndarray) -> None:
    time_s, position_px = swim()
    whole, trial = measured(time_s, position_px), measured(time_s, lose(position_px, ("caudal_fin",), frames))
    tip = FISHSIM_MARKERS.index("caudal_fin")

    assert "unread_marker" in kinds(trial)
    assert not trial.weight[trial.kept][:, tip].any()
    assert (trial.weight[trial.kept][:, :tip] > 0).all()
    assert trial.speed == pytest.approx(whole.speed, rel=1e-3)


def test_the_nose_missing_for_a_while_is_bridged_alike_in_trial_and_twin() -> None:
    time_s, position_px = swim()
    whole, gappy = measured(time_s, position_px), measured(time_s, lose(position_px, ("nose",), slice(120, 220)))
    seen = gappy.seen_head(whole.position_m)

    np.testing.assert_allclose(seen.path_m, gappy.head.path_m, atol=2e-3)
    assert gappy.speed == pytest.approx(whole.speed, rel=0.01)


def test_a_twin_that_diverges_is_not_hidden_by_a_gap() -> None:
    trial = measured(*swim())
    lost = trial.position_m.copy()
    lost[250:] = np.nan

    assert np.isnan(trial.seen_head(lost).path_m[1:]).all()


@pytest.mark.parametrize(
    ("changes", "kind"),
    [({"speed": -0.08}, "tail_first"), ({"turning": 0.3}, "turns"), ({"grows": 0.04}, "scale_drifts")],
)
def test_what_a_whole_trial_suffers_from_is_flagged(changes: dict[str, float], kind: str) -> None:
    assert kinds(measured(*swim(**changes))) == {kind}  # type: ignore[arg-type]


@few(5)
@given(grows=st.sampled_from([-1, 1]), by=st.floats(0.034, 0.036), seed=st.integers(0, 999))
def test_a_drift_of_the_scale_that_noise_hides_in_part_is_told_with_its_error(grows: int, by: float, seed: int) -> None:
    trial = measured(*swim(8.0, grows=grows * by, noise_px=1.6, seed=seed))
    (flag,) = (flag for flag in trial.flags if flag.kind == "scale_drifts")
    ((told, error),) = re.findall(r"by ([0-9.]+) %(?: \(standard error ([0-9.]+) %\))? from", flag.message)
    expected = 100 * by * 7 / 8  # the first second does not count
    assert float(told) == pytest.approx(expected, abs=1.2)
    assert not error or 0.6 < float(error) < float(told) / 2.5


@few(10)
@given(
    noise_px=st.floats(0.1, 4.0),
    lasts_s=st.floats(0.02, 0.5),
    seconds=st.floats(5.0, 20.0),
    hz=st.floats(0.7, 2.5),
    seed=st.integers(0, 9999),
)
def test_noise_that_lasts_makes_no_swim_unsteady(
    noise_px: float, lasts_s: float, seconds: float, hz: float, seed: int
) -> None:
    time_s, position_px = swim(seconds, hz)
    noise = lasting_noise((1, *position_px.shape), np.random.default_rng(seed), lasts_s)[0]
    assert "unsteady" not in kinds(measured(time_s, position_px + noise_px * noise))


@few(3)
@given(
    hz=st.floats(0.45, 0.75) | st.floats(1.25, 1.7),
    heading_rad=st.floats(0, 6.3),
    seconds=st.floats(5.5, 12.0),
    seed=st.integers(0, 99),
)
def test_a_shaken_camera_is_flagged(hz: float, heading_rad: float, seconds: float, seed: int) -> None:
    time_s, position_px = swim(seconds, seed=seed)
    way_px = 8.0 * np.array([np.cos(heading_rad), np.sin(heading_rad)])
    shaken = position_px + np.sin(2 * np.pi * hz * time_s + seed)[:, None, None] * way_px
    (flag,) = (flag for flag in measured(time_s, shaken).flags if flag.kind == "path_wobbles")
    amplitude_mm, found_hz = map(float, re.findall("by ([0-9]+) mm at ([0-9.]+) Hz", flag.message)[0])
    assert amplitude_mm == pytest.approx(8000 / PX_PER_M, abs=1.5)
    assert found_hz == pytest.approx(hz, abs=0.05)
    assert "path_wobbles" not in kinds(measured(time_s, position_px))


@few(5)
@given(
    marker=st.sampled_from(FISHSIM_MARKERS[2:-1]),
    way_mm=st.floats(18.0, 60.0),
    turned_rad=st.floats(0, 6.3),
    mirrored=st.booleans(),
    bends_mm=st.floats(-40.0, 40.0),
    seed=st.integers(0, 99),
)
def test_a_marker_that_slides_aside_of_its_neighbours_is_flagged_and_a_body_that_bends_is_not(
    marker: str, way_mm: float, turned_rad: float, mirrored: bool, bends_mm: float, seed: int
) -> None:
    time_s, position_px = swim(seed=seed)
    along = ROBOT.marker_positions_m(FISHSIM_MARKERS)[:, 0]
    since = time_s / time_s[-1]
    bend_px = bends_mm / 1000 * PX_PER_M * since[:, None] * np.clip((along - 0.25) / 0.3, 0.0, 1.0) ** 2
    bent = position_px - np.stack([np.zeros_like(bend_px), bend_px], axis=-1)
    creeps = np.array(bent)
    creeps[:, FISHSIM_MARKERS.index(marker), 1] -= way_mm / 1000 * PX_PER_M * since

    def seen(px: np.ndarray) -> np.ndarray:
        place = (px[..., 0] - 1500) + 1j * (px[..., 1] - 1500)
        place = (place.conj() if mirrored else place) * np.exp(1j * turned_rad)
        return np.stack([place.real, place.imag], axis=-1) + 1500

    (flag,) = (flag for flag in measured(time_s, seen(creeps)).flags if flag.kind == "marker_creeps")
    ((told_mm, side),) = re.findall("slides ([0-9]+) mm to the (left|right)", flag.message)
    assert flag.markers == (marker,)
    assert float(told_mm) == pytest.approx(way_mm * 4.0 / 5.0, rel=0.15, abs=5.0)  # the first second does not count
    assert side == ("left" if mirrored else "right")  # the fish swims to the picture's left
    assert "marker_creeps" not in kinds(measured(time_s, seen(bent)))


@few(5)
@given(
    hz=st.floats(0.6, 2.5),
    fps=st.floats(30.0, 120.0),
    speed=st.floats(0.08, 0.3),
    by=st.floats(0.3, 0.5),
    sign=st.sampled_from([-1, 0, 1]),
    turn=st.floats(0.0, 6.2),
    seed=st.integers(0, 99),
)
def test_a_swim_that_slows_or_hurries_is_flagged_and_a_steady_one_is_not(
    hz: float, fps: float, speed: float, by: float, sign: int, turn: float, seed: int
) -> None:
    time_s, position_px = swim(6.0, hz, speed, fps, seed=seed)
    position_px[..., 0] -= (PX_PER_M * speed * sign * by * time_s**2 / (2 * time_s[-1]))[:, None]
    trial = measured(time_s, position_px @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]))

    assert ("unsteady" in kinds(trial)) == bool(sign)


@few(5)
@given(
    hz=st.floats(0.7, 2.0),
    fps=st.floats(30.0, 120.0),
    by=st.floats(0.12, 0.25),
    sign=st.sampled_from([-1, 0, 1]),
    mirrored=st.booleans(),
    seed=st.integers(0, 99),
)
def test_a_beat_that_quickens_or_tires_is_flagged_and_a_steady_one_is_not(
    hz: float, fps: float, by: float, sign: int, mirrored: bool, seed: int
) -> None:
    time_s, fine_px = swim(6.0, hz, 0.1, 1000.0, noise_px=0.0)
    wanted_s = np.arange(0.0, 5.9, 1 / fps)
    drawn_s = wanted_s + sign * by * (wanted_s - 5.9) * wanted_s / (2 * 5.9)  # a beat that is 1 -/+ by / 2 as fast
    position_px = fine_px[np.searchsorted(time_s, np.clip(drawn_s, 0.0, time_s[-1]))]
    position_px = position_px - (0.1 * PX_PER_M * (wanted_s - drawn_s))[:, None, None] * [
        1.0,
        0.0,
    ]  # its speed is steady
    noise_px = np.random.default_rng(seed).normal(0.0, 0.3, position_px.shape)
    trial = measured(wanted_s, position_px * [1, -1 if mirrored else 1] + noise_px)

    told = [flag.message for flag in trial.flags if flag.kind == "unsteady"]
    assert bool(told) == bool(sign)
    for message in told:
        first, last = map(float, re.findall("([0-9.]+) Hz", message))
        assert np.sign(last - first) == sign
        assert abs(last - first) == pytest.approx(by * hz / 2, rel=0.25)


@pytest.mark.long
def test_a_fish_that_winds_its_way_and_one_whose_nose_is_unseen_for_a_while_do_not_wobble() -> None:
    time_s, position_px = swim(10.0)
    winding = 0.15 * np.sin(2 * np.pi * 0.25 * time_s)
    place = (position_px[..., 0] - 1500.0) + 1j * (position_px[..., 1] - 1500.0)
    nose = FISHSIM_MARKERS.index("nose")
    steps = np.diff(-0.1 * PX_PER_M * time_s, prepend=0.0) * np.exp(1j * winding)
    body = (place - place[:, [nose]]) * np.exp(1j * winding)[:, None]
    wound = np.cumsum(steps)[:, None] + body
    winds = np.stack([wound.real, wound.imag], axis=-1) + 1500.0
    assert "path_wobbles" not in kinds(measured(time_s, winds))
    assert "path_wobbles" not in kinds(measured(time_s, lose(position_px, ("nose",), slice(200, 320))))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda px: lose(px, ("nose",), slice(None, None, 1)), "never seen apart|usable"),
        (lambda px: lose(px, ("neck",), slice(30, None)), "frames with nose and neck|usable"),
        (lambda px: lose(px, FISHSIM_MARKERS[3:], slice(60, None)), "the tail cannot be read|usable"),
        (lambda px: px[:60], "are needed|less than one beat|beats at|too short"),
        (
            lambda px: px[:, [1, 0, *range(2, px.shape[1])]],
            "trial trial: nose and neck are exchanged; found the markers of the tail on",
        ),
    ],
)
def test_a_trial_that_cannot_be_read_says_why(change: Callable[[np.ndarray], np.ndarray], message: str) -> None:
    time_s, position_px = swim()
    changed = change(position_px)

    with pytest.raises(NotEnoughData, match=message):
        measured(time_s[: len(changed)], changed)


def test_a_stopped_film_that_leaves_too_little_of_a_held_out_trial_is_the_reason_told() -> None:
    time_s, position_px = swim(4.0)
    position_px[160:] = position_px[159]
    with pytest.raises(NotEnoughData, match=r"first beats of a held-out trial.*video stands still"):
        measured(time_s, position_px, "holdout")


def test_a_fast_beat_is_found_and_too_few_frames_for_it_are_refused() -> None:
    assert measured(*swim(hz=7.0, fps=60.0)).frequency.hz == pytest.approx(7.0, rel=0.01)
    with pytest.raises(NotEnoughData, match="frames a beat"):
        measured(*swim(hz=7.0, fps=30.0))


@given(seed=st.integers(0, 1000), beats=st.floats(3.0, 8.0), kept=st.floats(0.02, 1.0))
def test_what_is_called_determined_is_recovered(seed: int, beats: float, kept: float) -> None:
    """Of samples that pass, white noise moves no coefficient by more than ten times what it would if all were seen."""
    random = np.random.default_rng(seed)
    time_s = np.linspace(0.0, 1.0, 300)
    columns = smooth_swim(time_s, 2 * np.pi * beats * time_s, 2, 3)
    usable = random.random((300, 1)) < kept
    if determined(columns, usable)[0]:
        spread = np.sqrt(np.diag(np.linalg.inv(columns[usable[:, 0]].T @ columns[usable[:, 0]])))
        assert (spread * np.sqrt((columns**2).sum(axis=0)) <= 10.0 + 1e-6).all()
    else:
        assert kept < 0.35


def test_a_short_trial_is_taken_as_it_is() -> None:
    time_s = np.arange(120) / 60.0
    assert beating_part(time_s, np.zeros((120, 2)), np.ones((120, 2)), 1.0) == slice(0, 120)


def test_noise_that_lasts_long_is_taken_for_a_drift_of_the_scale_in_few_trials_and_a_drift_is_always_told() -> None:
    time_s, random = np.arange(0.0, 8.0, 1 / 120), np.random.default_rng(4)
    kept = np.ones(len(time_s), bool)
    told = {0.0: 0, 0.08: 0}
    for _ in range(100):
        noise_px = 0.6 * lasting_noise((1, len(time_s), 1, 1), random, 0.5).ravel()  # 30 frames at 120 a second
        for drift in told:
            span_px = 60.0 * (1 + drift * time_s / time_s[-1]) + noise_px
            told[drift] += bool(sight_flags(time_s, span_px, kept, kept, 0.6))
    assert told[0.0] <= 2
    assert told[0.08] == 100
