"""Names that change places are told, whichever they are and whenever they do, and those where no body has them."""

import numpy as np
import pytest

from swimcal.flags import Flag
from tests.tracking.fish import MARKERS, ROBOT, swimming_fish, tracks_of
from tests.tracking.records.trials import tracked_of, twin_px
from tracking.exchanges import exchanged_apart, impossible_flags, strayed_flags

FRAMES = 200


def samples_of(flags: tuple[Flag, ...]) -> np.ndarray:
    """(n, m) the samples that flags concern."""
    found = np.zeros((FRAMES, len(MARKERS)), bool)
    for flag in flags:
        first, last = flag.frames or (0, FRAMES - 1)
        found[first : last + 1, [MARKERS.index(name) for name in flag.markers]] = True
    return found


def other_names(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Some markers, and the same in another order."""
    some = rng.choice(len(MARKERS), int(rng.integers(2, 6)), replace=False)
    return some, np.roll(some, 1) if rng.random() < 0.5 else some[::-1]


@pytest.mark.parametrize("seed", range(20))
def test_names_that_change_places_are_told_with_their_frames(seed: int) -> None:
    rng = np.random.default_rng(seed)
    clean = swimming_fish(rng.uniform(0.3, 2.25), seed=seed, frames=FRAMES)
    already = samples_of(exchanged_apart(tracks_of(clean), ROBOT))
    some, named = other_names(rng)
    first = int(rng.integers(FRAMES // 2 + 10, FRAMES - 20))
    end = FRAMES if rng.random() < 0.5 else first + int(rng.integers(1, 20))
    wrong = np.zeros_like(already)
    wrong[first:end, some[some != named]] = True
    renamed = clean.copy()
    renamed[first:end, some] = clean[first:end, named]

    found = samples_of(exchanged_apart(tracks_of(renamed), ROBOT))
    assert (found | ~wrong).all()
    assert not (found & ~wrong & ~already).any()


def test_a_tail_that_is_named_from_its_tip_is_told() -> None:
    clean = swimming_fish(1.0, seed=3, frames=FRAMES)
    renamed = clean.copy()
    renamed[120:, 3:8] = clean[120:, 7:2:-1]
    (flag,) = exchanged_apart(tracks_of(renamed), ROBOT)
    assert flag.kind == "swap"
    assert set(flag.markers) == {"tail_1", "tail_2", "tail_4", "tail_5"}
    assert flag.frames == (120, FRAMES - 1)


@pytest.mark.parametrize("seed", range(12))
def test_two_markers_of_the_mid_line_with_each_others_names_all_along_are_told(seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    clean = swimming_fish(rng.uniform(0.3, 2.25), seed=seed, frames=FRAMES)
    middle = [name for name in MARKERS if abs(ROBOT.markers[name].position_m[1]) < 1e-6]
    one, other = (MARKERS.index(name) for name in rng.choice(middle, 2, replace=False))
    renamed = clean.copy()
    renamed[:, [one, other]] = clean[:, [other, one]]
    flags = exchanged_apart(tracks_of(renamed), ROBOT)
    assert {name for flag in flags for name in flag.markers} == {MARKERS[one], MARKERS[other]}
    assert samples_of(flags)[:, [one, other]].mean() > 0.95


TAIL = [MARKERS.index(name) for name in MARKERS if ROBOT.markers[name].body != "head"]


@pytest.mark.parametrize("seed", range(12))
def test_no_swim_is_impossible(seed: int) -> None:
    rng = np.random.default_rng(seed)
    clean = swimming_fish(rng.uniform(0.3, 2.25), seed=seed, frames=FRAMES) * rng.uniform(0.4, 1.5)
    clean[50:][rng.random((FRAMES - 50, len(MARKERS))) < 0.2] = np.nan
    assert not impossible_flags(tracked_of(clean), ROBOT)


@pytest.mark.parametrize("seed", range(12))
def test_names_that_turned_round_on_the_tail_are_impossible_although_others_are_lost(seed: int) -> None:
    rng = np.random.default_rng(seed)
    clean = swimming_fish(rng.uniform(0.3, 2.25), seed=seed, frames=FRAMES)
    renamed = clean.copy()
    renamed[120:, TAIL] = clean[120:, TAIL[::-1]]
    renamed[120:, rng.choice(TAIL[1:-1], 2, replace=False)] = np.nan
    found = samples_of(tuple(impossible_flags(tracked_of(renamed), ROBOT)))
    assert found[120:, TAIL][np.isfinite(renamed[120:, TAIL, 0])].mean() > 0.99
    assert not found[:120].any()


@pytest.mark.parametrize("seed", range(12))
def test_one_marker_that_leaves_the_body_is_impossible_and_no_other(seed: int) -> None:
    rng = np.random.default_rng(seed)
    left = swimming_fish(rng.uniform(0.3, 2.25), seed=seed, frames=FRAMES)
    marker = int(rng.choice([0, 1, *TAIL]))
    left[100:140, marker] += 3 * (left[100:140, 1] - left[100:140, 0])[:, ::-1] * [1, -1]  # across the head
    found = samples_of(tuple(impossible_flags(tracked_of(left), ROBOT)))
    assert found[100:140, marker].all()
    assert not np.delete(found, [marker, 0, 1], axis=1).any()


@pytest.mark.parametrize("seed", range(12))
def test_names_found_one_dot_along_behind_a_cover_do_not_count_until_the_names_are_sure(seed: int) -> None:
    rng = np.random.default_rng(seed)
    clean = swimming_fish(rng.uniform(0.3, 2.25), seed=seed, frames=FRAMES)
    covered, whole_again, end = 80, 100, int(rng.integers(140, 190))
    slid = clean.copy()
    slid[covered:whole_again, TAIL] = np.nan
    slid[whole_again:end, TAIL[:-2]] = clean[whole_again:end, TAIL[1:-1]]  # one dot along, the last two stay lost
    slid[whole_again:end, TAIL[-2:]] = np.nan
    found = samples_of(tuple(impossible_flags(tracked_of(slid), ROBOT)))
    assert found[whole_again:end][:, TAIL[:-2]].all()
    assert not found[:covered].any()
    assert not found[end:].any()
    back = clean.copy()
    back[covered:whole_again, TAIL] = np.nan
    assert not impossible_flags(tracked_of(back), ROBOT)


@pytest.mark.parametrize("seed", range(6))
def test_a_marker_of_the_head_found_again_on_another_dot_does_not_count_until_it_is_back(seed: int) -> None:
    rng = np.random.default_rng(seed)
    dorsal, clean = MARKERS.index("dorsal_fin"), swimming_fish(rng.uniform(0.3, 2.25), seed=seed, frames=FRAMES)
    covered, found_again, end = 60, 60 + int(rng.integers(12, 30)), int(rng.integers(140, 190))
    lost = clean.copy()
    lost[covered:found_again, dorsal] = np.nan
    lost[:, TAIL[3]] = np.nan  # never seen, which warns of nothing
    assert not strayed_flags(tracked_of(lost), ROBOT)
    strayed = lost.copy()
    strayed[found_again:end, dorsal] = clean[found_again:end, TAIL[0]]
    found = samples_of(tuple(strayed_flags(tracked_of(strayed), ROBOT)))
    assert found[found_again:end, dorsal].all()
    assert not np.delete(found, dorsal, axis=1).any()
    assert not found[:covered].any()
    assert not found[end + 12 :].any()


@pytest.mark.parametrize("seed", range(6))
def test_a_marker_of_the_head_that_goes_to_another_dot_does_not_count_until_it_is_back(seed: int) -> None:
    rng, swims = np.random.default_rng(seed), twin_px()
    dorsal, clean = MARKERS.index("dorsal_fin"), swims[seed % len(swims)][:FRAMES].copy()
    clean += rng.normal(0, 0.3, clean.shape)
    assert not strayed_flags(tracked_of(clean), ROBOT)
    first, strayed = int(rng.integers(60, 120)), clean.copy()
    end = FRAMES if seed % 2 else first + int(rng.integers(10, 60))
    strayed[first:end, dorsal] = clean[first:end, TAIL[0]]
    found = samples_of(tuple(strayed_flags(tracked_of(strayed), ROBOT)))
    wrong = np.zeros_like(found)
    wrong[first:end, dorsal] = True
    np.testing.assert_array_equal(found, wrong)


def test_names_that_are_shifted_together_are_wrong_together() -> None:
    """Behind a cover three names come back one dot ahead of their own; the steps between them are right."""
    clean = swimming_fish(1.0, seed=5, frames=FRAMES)
    shifted = clean.copy()
    shifted[60:80, TAIL] = np.nan
    shifted[80:, TAIL[:2]] = np.nan
    shifted[80:, TAIL[2:5]] = clean[80:, TAIL[1:4]]
    found = samples_of(tuple(impossible_flags(tracked_of(shifted), ROBOT)))
    assert found[80:, TAIL[2:5]].mean() > 0.9
    assert not found[:60].any()


def test_boxes_on_one_place_raise_no_warning() -> None:
    """Two start boxes on one spot, and a nose that lands on the neck."""
    clean = swimming_fish(1.0, seed=5, frames=FRAMES)
    clean[:, TAIL[1]] = clean[:, TAIL[2]]
    clean[100:110, 0] = clean[100:110, 1]
    with np.errstate(all="raise"):
        found = samples_of(tuple(impossible_flags(tracked_of(clean), ROBOT)))
    assert found[100:110].any(axis=1).all()
