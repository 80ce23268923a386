"""Doubts about tracks: exchanged, lost, drifting and wrongly sized markers are flagged where they are, others not."""

from itertools import pairwise

import numpy as np
import pytest
import xarray as xr

from swimcal.flags import Flag
from swimcal.tracks import as_tracks
from tests.tracking.boxes.drawn import ELEVEN, NINE
from tests.tracking.fish import ROBOT, swimming_fish
from tests.tracking.tracker.pool import fish
from tracking.judgement import judge
from tracking.tracked import SampleState, with_states

FRAMES = 150


def trial_of(position_px: np.ndarray, markers: tuple[str, ...] = NINE, confidence: float = 0.95) -> xr.Dataset:
    n, m, _ = position_px.shape
    state = np.where(np.isfinite(position_px).all(axis=2), SampleState.MEASURED, SampleState.MISSING).astype(np.int8)
    tracks = as_tracks(markers, np.arange(n) / 60, position_px, np.full((n, m), confidence))
    return with_states(tracks, state, np.full((n, m), 14.0))


def swum(
    hz: float = 1.5, bend: float = 0.5, heading: float = 0.2, markers: tuple[str, ...] = NINE, noise: float = 0.1
) -> np.ndarray:
    """(n, m, 2) clean tracks of a fish."""
    path = fish(markers, hz, bend, heading)
    clean = np.stack([path(k) for k in range(FRAMES)])
    return clean + np.random.default_rng(0).normal(0, noise, clean.shape)


def flags_of(kind: str, flags: tuple[Flag, ...]) -> list[Flag]:
    return [flag for flag in flags if flag.kind == kind]


def flagged_frames(flags: list[Flag]) -> set[int]:
    return {frame for flag in flags if flag.frames for frame in range(flag.frames[0], flag.frames[1] + 1)}


@pytest.mark.parametrize("hz", [0.5, 1.5, 2.25])
@pytest.mark.parametrize("bend", [0.3, 0.6, 1.2])
@pytest.mark.parametrize("heading", [0.2, 2.0, -2.6])
def test_a_clean_swim_is_not_flagged_however_it_bends_and_heads(hz: float, bend: float, heading: float) -> None:
    assert judge(trial_of(swum(hz, bend, heading, ELEVEN, noise=0.3), ELEVEN), ROBOT) == ()


def test_boxes_placed_by_hand_are_hardly_ever_taken_for_exchanged() -> None:
    """12 made-up trials with jitter of half a pixel and boxes beside their markers by 2.5 px: below 0.1 % of pairs."""
    wrong = 0
    for seed in range(12):
        clean = swimming_fish(0.5 + 0.16 * seed, seed, frames=FRAMES)
        wrong += len(flagged_frames(flags_of("swap", judge(trial_of(clean), ROBOT))))
    assert wrong <= 0.001 * 12 * FRAMES * (len(NINE) - 1)


def test_names_on_others_dots_are_not_taken_for_too_few_frames() -> None:
    """Names that change places in every second frame move by the whole distance between their dots."""
    mixed = swum()
    ones = [NINE.index("tail_2"), NINE.index("tail_4")]
    mixed[40:60:2, ones] = mixed[40:60:2, ones[::-1]]
    flags = judge(trial_of(mixed), ROBOT)
    assert flagged_frames(flags_of("swap", flags))
    assert not flags_of("few_frames", flags)


def test_a_marker_that_grows_alone_is_flagged_and_not_all_that_grow_together() -> None:
    grown = np.linspace(0.6, 1.6, FRAMES)[:, None]
    together, alone = trial_of(swum()), trial_of(swum())
    together["size"] = together["size"] * grown
    alone["size"][:, [2]] = alone["size"][:, [2]].values * grown
    assert not flags_of("size", judge(together, ROBOT))
    assert {flag.markers for flag in flags_of("size", judge(alone, ROBOT))} == {NINE[2:3]}


def test_what_hardly_looks_like_its_marker_does_not_count_in_a_single_frame() -> None:
    trial = trial_of(swum())
    trial.confidence[70, NINE.index("tail_3")] = 0.1
    assert [(flag.kind, flag.markers, flag.frames) for flag in judge(trial, ROBOT)] == [
        ("drift", ("tail_3",), (70, 70))
    ]


@pytest.mark.parametrize("frames", [2, 5, 40])
@pytest.mark.parametrize("pair", list(pairwise(NINE)), ids=lambda pair: pair[1])
@pytest.mark.parametrize("bend", [0.3, 1.0])
def test_exchanged_neighbours_are_flagged_in_exactly_their_frames(
    frames: int, pair: tuple[str, str], bend: float
) -> None:
    position = swum(bend=bend)
    a, b = (NINE.index(name) for name in pair)
    span = slice(50, 50 + frames)
    position[span, [a, b]] = position[span, [b, a]]
    swaps = flags_of("swap", judge(trial_of(position), ROBOT))
    own = [flag for flag in swaps if set(flag.markers) == set(pair)]
    assert flagged_frames(own) == set(range(50, 50 + frames))
    assert flagged_frames(swaps) == set(range(50, 50 + frames))


@pytest.mark.parametrize("frames", [2, 40])
@pytest.mark.parametrize("heading", [0.2, 2.0, -2.6])
def test_exchanged_pectorals_are_flagged_in_exactly_their_frames(frames: int, heading: float) -> None:
    position = swum(heading=heading, markers=ELEVEN)
    position[30 : 30 + frames, [9, 10]] = position[30 : 30 + frames, [10, 9]]
    flags = judge(trial_of(position, ELEVEN), ROBOT)
    assert [(flag.kind, set(flag.markers), flag.frames) for flag in flags] == [
        ("swap", {"pectoral_left", "pectoral_right"}, (30, 29 + frames))
    ]


def test_predicted_and_interpolated_samples_are_lost_ones_by_hand_are_not() -> None:
    trial = trial_of(swum())
    trial.state.values[10:15, 1], trial.state.values[20:25, 2] = SampleState.PREDICTED, SampleState.INTERPOLATED
    trial.state.values[30:35, 3] = SampleState.BY_HAND
    flags = judge(trial, ROBOT)
    assert [(flag.kind, flag.markers, flag.frames) for flag in flags] == [
        ("lost_marker", ("neck",), (10, 14)),
        ("lost_marker", ("dorsal_fin",), (20, 24)),
    ]


@pytest.mark.parametrize("factor", [0.6, 1.5])
def test_a_wrong_size_is_flagged_where_it_lasts_and_not_in_one_frame(factor: float) -> None:
    trial = trial_of(swum())
    trial["size"].values[:] *= np.random.default_rng(2).uniform(0.95, 1.05, trial["size"].values.shape)
    trial["size"].values[60:80, 4] *= factor
    trial["size"].values[100, 6] *= factor
    flags = judge(trial, ROBOT)
    assert [(flag.kind, flag.markers) for flag in flags] == [("size", ("tail_2",))]
    assert flags[0].frames == (60, 79)


def test_low_confidence_that_lasts_is_a_drift() -> None:
    trial = trial_of(swum())
    trial.confidence.values[40:60, 2] = 0.2
    trial.confidence.values[80:89, 5] = 0.2  # one frame too short
    flags = judge(trial, ROBOT)
    assert [(flag.kind, flag.markers, flag.frames) for flag in flags] == [("drift", ("dorsal_fin",), (40, 59))]


@pytest.mark.parametrize(("missing", "told"), [(3, False), (8, False), (40, True)])
def test_names_are_not_sure_after_a_gap_in_which_the_robot_gets_to_other_markers_places(
    missing: int, told: bool
) -> None:
    whole = trial_of(swum(hz=0.7))
    trial = whole.isel(time=[frame for frame in range(FRAMES) if not 60 <= frame < 60 + missing])
    trial = trial.assign_attrs(flags=())
    flags = flags_of("damaged_video", judge(trial, ROBOT))
    assert [flag.frames for flag in flags] == ([(60, FRAMES - missing - 1)] if told else [])
    assert all("names are not sure from there on" in flag.message for flag in flags)


@pytest.mark.parametrize(("length", "counts"), [(1, False), (4, False), (12, True)])
def test_a_marker_that_is_seen_for_a_moment_amid_frames_without_it_does_not_count(length: int, counts: bool) -> None:
    position = swum()
    lost = np.ones(60, bool)
    lost[25 : 25 + length] = False
    position[40:100, 4][lost] = np.nan
    moments = [flag.frames for flag in flags_of("drift", judge(trial_of(position), ROBOT))]

    assert moments == ([] if counts else [(65, 65 + length - 1)])


@pytest.mark.parametrize(("hidden", "doubted"), [(3, False), (4, False), (5, True), (8, True)])
def test_what_is_left_of_a_row_is_doubted_while_half_of_it_is_not_seen(hidden: int, doubted: bool) -> None:
    position = swum(markers=NINE)
    gone = np.random.default_rng(hidden).choice(len(NINE), hidden, replace=False)
    position[60:80, gone] = np.nan

    found = [flag for flag in judge(trial_of(position), ROBOT) if "nothing tells whose dots" in flag.message]
    left = tuple(name for k, name in enumerate(NINE) if k not in gone)
    assert [(flag.kind, flag.markers, flag.frames) for flag in found] == (
        [("drift", left, (60, 79))] if doubted else []
    )
