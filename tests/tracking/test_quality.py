import warnings
from collections.abc import Sequence
from itertools import product

import numpy as np
import pytest
import xarray as xr

from swimcal.flags import Flag
from swimcal.robot import Marker
from swimcal.tracks import load_tracks, pixels_of
from tests.cases import later
from tests.swimcal.sample import FISHSIM, needs_fishsim
from tests.tracking.fish import FPS, MARKERS, ROBOT, swimming_fish, tracks_of, with_fault
from tracking.quality import TrackQuality, check_tracks

SPEEDS_HZ = (0.3, 1.0, 2.25)
CLEAN = ("f1_00", "f0_75")


def checked(position_px: np.ndarray, markers: Sequence[str] = MARKERS) -> TrackQuality:
    return check_tracks(tracks_of(position_px, markers), ROBOT)


def left_out(position_px: np.ndarray) -> np.ndarray:
    return checked(position_px).weight == 0


def flags_of_marker(quality: TrackQuality, name: str) -> list[Flag]:
    return [flag for flag in quality.flags if flag.markers[0] == name]


# ---- faults put into clean tracks


def shares_found(kind: str, clean: Sequence[np.ndarray], seed: int) -> tuple[float, float]:
    """Share of samples misplaced by 8 px or more that are left out; share of the clean ones that are."""
    rng = np.random.default_rng(seed)
    found = misplaced = false = untouched = 0
    for clean_px in clean:
        already = left_out(clean_px)
        for k in range(len(MARKERS)):
            faulty = with_fault(kind, clean_px, k, rng)
            out = left_out(faulty.position_px)
            far = faulty.touched & (np.linalg.norm(faulty.position_px - clean_px, axis=2) >= 8)
            near = np.apply_along_axis(np.convolve, 0, faulty.touched, np.ones(7), "same") > 0
            found, misplaced = found + (out & far).sum(), misplaced + far.sum()
            false, untouched = false + (out & ~near & ~already).sum(), untouched + (~near).sum()
    return found / misplaced, false / untouched


@pytest.mark.long
@pytest.mark.parametrize(
    ("kind", "speeds_hz"),
    [("merge", (1.0,)), *later(*((kind, SPEEDS_HZ) for kind in ("freeze", "hop", "jump", "merge", "swap")))],
)
def test_faults_in_a_made_up_fish_are_left_out_and_nothing_else(kind: str, speeds_hz: tuple[float, ...]) -> None:
    recall, false = shares_found(kind, [swimming_fish(hz, seed=1) for hz in speeds_hz], seed=2)
    assert recall >= 0.95
    assert false <= 0.005


@needs_fishsim
@pytest.mark.parametrize(
    ("kind", "names"),
    [("swap", ("f1_00",)), *later(*((kind, CLEAN) for kind in ("jump", "swap", "merge", "freeze", "hop")))],
)
def test_faults_in_clean_real_trials_are_left_out_and_nothing_else(kind: str, names: tuple[str, ...]) -> None:
    recall, false = shares_found(kind, [pixels_of(real(name)) for name in names], seed=3)
    assert recall >= 0.95
    assert false <= 0.005


@pytest.mark.parametrize("hz", [0.3, 0.6, 1.0, 1.6, 2.25, 2.5])
@pytest.mark.parametrize("seed", [10, *later(11, 12)])
def test_a_fish_without_faults_has_no_flags(hz: float, seed: int) -> None:
    assert left_out(swimming_fish(hz, seed)).mean() <= 0.005


def turning_sharply(hz: float, seed: int, sway_px: float) -> np.ndarray:
    """A fish whose caudal fin sways from side to side at a steady speed and turns round at once."""
    position = swimming_fish(hz, seed)
    along = position[:, 8] - position[:, 7]
    across = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.linalg.norm(along, axis=1, keepdims=True)
    sway = 2 / np.pi * np.arcsin(np.sin(2 * np.pi * hz * np.arange(len(position)) / FPS - 1.0))
    position[:, 8] += sway_px * sway[:, None] * across
    return position


@pytest.mark.long
def test_a_caudal_fin_that_turns_sharply_is_believed_from_one_turn_to_the_next() -> None:
    """Followed either way it is a frame late at every turn: no jump and its way back with half a trial between."""
    assert np.mean([left_out(turning_sharply(1.76, seed, 25.0)) for seed in range(4)]) <= 0.005


def with_gaps(position_px: np.ndarray, seed: int) -> np.ndarray:
    """The places (n, m, 2) without 5 % of the samples, and without a marker of head and tail for a while."""
    rng, gapped = np.random.default_rng(seed), position_px.copy()
    gapped[rng.random(gapped.shape[:2]) < 0.05] = np.nan
    for marker, longest in ((rng.integers(0, 2), 36), (rng.integers(3, 9), 150)):
        first = rng.integers(0, len(gapped) - longest)
        gapped[first : first + rng.integers(6, longest), marker] = np.nan
    return gapped


@pytest.mark.long
@pytest.mark.parametrize("seeds", [range(20, 23), *later(range(23, 40))])
@pytest.mark.parametrize("hz", [0.5, 1.0])
def test_what_is_seen_counts_although_other_samples_are_missing(hz: float, seeds: range) -> None:
    lost = []
    for seed in seeds:
        position = with_gaps(swimming_fish(hz, seed), seed)
        lost.append(np.mean(left_out(position) & np.isfinite(position).all(axis=2)))
    assert np.mean(lost) <= 0.005
    assert max(lost) <= 0.015


@pytest.mark.long
@pytest.mark.parametrize("kind", ["jump", *later("merge", "freeze", "hop", "swap")])
def test_faults_are_found_among_missing_samples_too(kind: str) -> None:
    recall, false = shares_found(kind, [with_gaps(swimming_fish(1.0, seed=1), seed=1)], seed=2)
    assert recall >= 0.85
    assert false <= 0.01


@pytest.mark.parametrize("seed", [6, *later(7, 8)])
def test_a_neck_whose_nose_left_the_picture_is_believed_and_its_leap_is_not(seed: int) -> None:
    """Nothing but the nose tells where the neck is along the head: without it it may be further off."""
    position = swimming_fish(1.0, seed)
    position[150:, 0] = np.nan
    leapt = position.copy()
    leapt[200:240, 1] += [30.0, 25.0]
    assert not left_out(position)[:, 1:].any()
    assert left_out(leapt)[200:240, 1].all()
    assert left_out(leapt)[:, 1:].sum() == 40


@pytest.mark.parametrize(("moved", "onto"), [(6, 7), (7, 6), *later((5, 4), (4, 5)), (8, 7)])
@pytest.mark.parametrize("share", [0.6, 0.9])
def test_a_merge_for_most_of_a_trial_is_laid_to_the_one_that_moved(moved: int, onto: int, share: float) -> None:
    position = swimming_fish(1.0, seed=4)
    span = slice(10, 10 + int(share * len(position)))
    rng = np.random.default_rng(5)
    position[span, moved] = position[span, onto] + np.round(rng.normal(1, 0.7, (span.stop - span.start, 2)))
    quality = checked(position)
    out = quality.weight == 0
    assert out[span, moved].mean() > 0.95
    out[span, moved] = False
    assert out.mean() <= 0.005
    (flag,) = flags_of_marker(quality, MARKERS[moved])
    assert flag.kind == "merged_markers"
    assert flag.markers == (MARKERS[moved], MARKERS[onto])


# ---- names, numbers and places


def test_a_frozen_box_is_named_so() -> None:
    position = swimming_fish(1.0, seed=6)
    position[100:140, 5] = position[99, 5]
    (flag,) = checked(position).flags
    assert (flag.kind, flag.markers) == ("frozen_marker", ("tail_3",))
    assert flag.frames is not None
    assert flag.frames == pytest.approx((100, 139), abs=3)
    assert "stands still" in flag.message


def test_a_fish_at_rest_has_no_frozen_boxes() -> None:
    still = np.repeat(swimming_fish(1.0, seed=6)[:1], 120, axis=0)
    assert checked(still).flags == ()


def turning_about_its_neck(hz: float, seed: int) -> np.ndarray:
    """(n, 3, 2) nose, neck and fin of a fish in sticky water: the head turns about the neck, the tail lashes."""
    rng = np.random.default_rng(seed)
    phase = 2 * np.pi * (hz * np.arange(300) / FPS + rng.random())
    head, lag = rng.uniform(0.2, 0.35) * np.sin(phase), rng.uniform(0.5, 2.0)
    tail = 0.3 * np.sin(phase - lag) + 0.06 * np.sin(3 * (phase - lag))  # it turns round sharply
    nose = 135.0 * np.stack([-np.cos(head), np.sin(head)], axis=1)
    fin = 380.0 * np.stack([np.cos(tail), np.sin(tail)], axis=1)
    neck = np.stack([-5.0 * phase, 1.5 * np.sin(phase + 1.0)], axis=1)
    position = np.stack([neck + nose, neck, neck + fin], axis=1)
    return position + rng.normal(0.0, 0.2, position.shape) + 900.0


@pytest.mark.parametrize("hz", [0.8, 1.2, 1.8, 2.4])
@pytest.mark.parametrize("seed", range(3))
def test_the_neck_about_which_a_head_turns_is_not_frozen_and_a_lashing_fin_does_not_leap(hz: float, seed: int) -> None:
    judged = checked(turning_about_its_neck(hz, seed), ("nose", "neck", "caudal_fin"))
    assert judged.used_fraction >= 0.99, judged.flags


@pytest.mark.parametrize("seed", range(3))
def test_a_neck_that_stays_behind_is_frozen_though_heads_turn_about_it(seed: int) -> None:
    position = turning_about_its_neck(1.2, seed)
    position[:, :, 0] -= 2.5 * np.arange(300)[:, None]  # it swims
    truth = position.copy()
    position[120:150, 1] = position[119, 1]
    far = np.linalg.norm(position - truth, axis=2) > 15.0
    judged = checked(position, ("nose", "neck", "caudal_fin"))
    assert not judged.weight[far].any()
    assert judged.weight[~far].mean() > 0.9


def held_by_its_head(markers: Sequence[str], seed: int) -> np.ndarray:
    """(n, m, 2) a fish whose head is clamped: the swimming one, turned and moved back frame by frame."""
    position = swimming_fish(1.0, seed=seed)
    nose, neck = position[:, 0], position[:, 1]
    away = np.arctan2(*(neck - nose)[:, ::-1].T)
    cos, sin = np.cos(-away)[:, None], np.sin(-away)[:, None]
    x, y = np.moveaxis(position - nose[:, None], 2, 0)
    still = np.stack([cos * x - sin * y + 900.0, sin * x + cos * y + 700.0], axis=2)
    return still[:, [MARKERS.index(name) for name in markers]]


@pytest.mark.parametrize("seed", [0, *later(1, 2)])
@pytest.mark.parametrize("head", ["nose", "neck"])
@pytest.mark.parametrize("tail", [("tail_2", "tail_4"), ("tail_1", "tail_3", "caudal_fin"), MARKERS[3:]])
def test_the_only_marker_of_a_clamped_head_is_not_frozen(head: str, tail: tuple[str, ...], seed: int) -> None:
    markers = (head, *tail)
    assert not flags_of_marker(checked(held_by_its_head(markers, seed), markers), head)


def test_a_box_on_the_background_is_frozen_though_it_rests_through_the_trial() -> None:
    markers = ("nose", *MARKERS[3:])
    position = swimming_fish(1.0, seed=6)[:, [MARKERS.index(name) for name in markers]]
    position[:, 0] = position[0, 0]
    weight = checked(position, markers).weight[:, 0]
    assert np.mean(weight[60:] == 0) > 0.9


def test_a_short_leap_is_a_jump() -> None:
    position = swimming_fish(1.0, seed=6)
    position[150:152, 4] += [14.0, -9.0]
    (flag,) = checked(position).flags
    assert (flag.kind, flag.markers, flag.frames) == ("jump", ("tail_2",), (150, 151))
    assert "jumps, 16 px" in flag.message


@pytest.mark.long
@pytest.mark.parametrize("seeds", [[6], *later(range(7, 22))])
def test_of_three_markers_on_the_rigid_head_the_one_that_leapt_is_left_out(seeds: Sequence[int]) -> None:
    """In nine of ten cases, and no frame else."""
    told = []
    for seed, k in product(seeds, range(3)):
        position = swimming_fish(1.0, seed)
        position[100:140, k] += [7.0, 9.0]
        out = left_out(position)
        told.append(out[100:140, k].all() and out.sum() == 40)
    assert np.mean(told) >= 0.9


def test_every_sample_of_weight_0_is_in_a_flag_of_its_marker() -> None:
    position = swimming_fish(1.0, seed=6)
    position[20:30, 3] = np.nan
    position[60:90, 6] = position[60:90, 7]
    position[200:203, 0] += 20
    quality = checked(position)
    named = np.zeros(quality.weight.shape, dtype=bool)
    for flag in quality.flags:
        assert flag.frames is not None
        named[flag.frames[0] : flag.frames[1] + 1, MARKERS.index(flag.markers[0])] = True
    assert (named == (quality.weight == 0)).all()
    assert quality.used_fraction == pytest.approx(1 - named.mean())


def test_a_marker_the_robot_lacks_is_refused_with_the_choices() -> None:
    with pytest.raises(ValueError, match=r"no marker beak on fish_057; choices: nose, neck, .*caudal_fin"):
        check_tracks(tracks_of(np.zeros((5, 2, 2)), ["nose", "beak"]), ROBOT)


# ---- invariance and other swimmers


@pytest.mark.parametrize("segments", [3, 7])
def test_a_robot_with_another_number_of_segments(segments: int) -> None:
    head = {name: ROBOT.markers[name] for name in ("nose", "neck", "dorsal_fin")}
    tail = {
        f"tail_{i + 1}": Marker(body="tail_1", position_m=(0.31 + 0.16 * i / (segments - 1), 0.0, 0.05))
        for i in range(segments)
    }
    robot = ROBOT.model_copy(update={"markers": {**head, **tail}})
    names = tuple(robot.markers)
    position = swimming_fish(1.2, seed=9, markers=names, robot=robot)
    assert check_tracks(tracks_of(position, names), robot).flags == ()
    position[100:130, 4] = position[100:130, 5] + 1
    (flag,) = check_tracks(tracks_of(position, names), robot).flags
    assert flag.markers == ("tail_2", "tail_3")
    assert flag.frames == (100, 129)


# ---- poor input


@pytest.mark.parametrize("frames", [0, 1, 2, 3, 5, 12])
def test_short_trials_are_believed(frames: int) -> None:
    assert checked(swimming_fish(1.0, seed=6)[:frames]).flags == ()


def test_degenerate_tracks_raise_no_warnings() -> None:
    rng = np.random.default_rng(0)
    random = rng.uniform(0, 3000, (60, 9, 2))
    sparse = np.where(rng.random((60, 9, 1)) < 0.8, np.nan, swimming_fish(1.0, seed=6, frames=60))
    never_together = np.full((60, 9, 2), np.nan)
    never_together[np.arange(60), np.arange(60) % 9] = 5.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for position in (random, sparse, never_together, np.zeros((60, 9, 2)), np.full((60, 9, 2), np.nan)):
            quality = checked(position)
            assert np.isfinite(quality.weight).all()
            assert 0 <= quality.used_fraction <= 1


# ---- the public trials: the truth was found by eye, in plots of segment lengths and head-frame paths

SEEN_BY_EYE: dict[str, dict[str, list[tuple[int, int]]]] = {
    "f0_50": {
        "tail_3": [(13, 27)],
        "tail_2": [(20, 23)],
        "caudal_fin": [(122, 122), (184, 187), (334, 338)],
    },
    "f0_75": {},
    "f1_00": {"tail_1": [(5, 5)], "tail_2": [(13, 13)]},
    "f1_25": {
        "tail_4": [(31, 60), (93, 125), (154, 190), (220, 254), (281, 300)],
        "tail_1": [(60, 62), (125, 130)],
        "neck": [(13, 15)],
        "caudal_fin": [(53, 56), (108, 112)],
    },
    "f1_75": {"tail_4": [(26, 35), (83, 103)], "tail_1": [(22, 27)], "caudal_fin": [(198, 202)]},
}
"""Stretches in which a box is off, slight ones too."""

CERTAIN = {
    "f0_50": {"tail_3": [(24, 27)]},
    "f1_25": {"tail_4": [(31, 60), (101, 125), (159, 190), (223, 254), (284, 300)]},
    "f1_75": {"tail_4": [(26, 35), (83, 103)], "tail_1": [(24, 26)], "caudal_fin": [(201, 202)]},
}
"""Those by 10 px and more, which must be left out."""


def real(name: str) -> xr.Dataset:
    return load_tracks(FISHSIM / f"{name}.csv", MARKERS, FPS)


def marked(stretches: dict[str, list[tuple[int, int]]], frames: int) -> np.ndarray:
    mask = np.zeros((frames, len(MARKERS)), dtype=bool)
    for name, spans in stretches.items():
        for first, last in spans:
            mask[first : last + 1, MARKERS.index(name)] = True
    return mask


@needs_fishsim
@pytest.mark.parametrize("name", SEEN_BY_EYE)
def test_flags_of_the_public_trials_are_what_the_eye_sees(name: str) -> None:
    tracks = real(name)
    out = check_tracks(tracks, ROBOT).weight == 0
    must, may = marked(CERTAIN.get(name, {}), len(out)), marked(SEEN_BY_EYE[name], len(out))
    assert out[must].all()
    assert out[~may].mean() <= 0.001
    assert out.mean() <= 0.06
