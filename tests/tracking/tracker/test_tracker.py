"""The marker tracker on drawn pools: fast tails, covers, the border, glints, crossings, bad boxes, going on again."""

import numpy as np
import pytest

from tests.cases import later
from tests.tracking.tracker.pool import WATER, Pool, Thing, drifting, errors, still, tail
from tracking.tracker import MarkerTracker


def rms_axis(away: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean(away**2) / 2))


@pytest.mark.parametrize(
    ("hz", "spacing", "bend", "diameter"), [(2.25, 18, 0.8, 14), (2.25, 18, 1.3, 14), (2.25, 14, 0.8, 11)]
)
def test_a_fast_tail_with_close_neighbours_is_never_lost(
    hz: float, spacing: float, bend: float, diameter: float
) -> None:
    pool = Pool(tail(hz, spacing, bend), (320, 340), diameter)
    away = errors(pool.followed(45), pool.truths(45))
    assert np.isfinite(away).all()
    assert rms_axis(away) < 0.05
    assert np.max(away) < 0.3


@pytest.mark.parametrize(
    ("covered", "size"), [*later(((5,), (22.0, 22.0)), ((8,), (22.0, 22.0))), ((5, 6, 7), (64.0, 44.0))]
)
@pytest.mark.parametrize("use_csrt", [False, *later(True)])
def test_covered_markers_are_unseen_for_as_long_and_found_again_as_themselves(
    covered: tuple[int, ...], size: tuple[float, float], use_csrt: bool
) -> None:
    path = tail(1.5)
    middle = covered[len(covered) // 2]
    pool = Pool(path, (320, 340), things=(Thing(lambda f: path(f)[middle], size, WATER, (20, 34)),))
    away = errors(pool.followed(50, use_csrt), pool.truths(50))
    seen = np.isfinite(away)
    assert not seen[20:35, covered].any()
    assert seen[36:].all()
    assert seen[:20].all()
    assert np.max(away[36:]) < 0.3
    assert np.nanmax(away) < 4.0  # dots that the cover leaves half in sight


def test_a_half_covered_marker_is_flagged() -> None:
    pool = Pool(still((60, 60), (100, 60), (140, 60)), (200, 120))
    pool = pool.but(things=(Thing(lambda _: np.array([114.0, 60.0]), (28.0, 40.0), WATER, (5, 12)),))
    sightings = pool.followed(16)
    away = errors(sightings, pool.truths(16))[:, 1]
    confidence = np.stack([s.confidence for s in sightings])[:, 1]
    assert (confidence[5:13][away[5:13] > 1] < 0.35).all()
    assert (confidence[14:] > 0.6).all()


@pytest.mark.parametrize("use_csrt", [False, True])
def test_a_marker_that_leaves_the_picture_is_unseen_and_put_nowhere_else(use_csrt: bool) -> None:
    pool = Pool(drifting([(40, 60), (80, 60), (120, 60)], (-2.0, 0.2)), (200, 120))
    sightings, truth = pool.followed(45, use_csrt), pool.truths(45)
    away = errors(sightings, truth)
    assert np.isnan(away[truth[..., 0] < 2]).all()
    assert np.isfinite(away[truth[..., 0] > 8]).all()
    assert np.nanmax(away) < 2.0


@pytest.mark.parametrize("seed", [0, 1, *later(2, 3)])
@pytest.mark.parametrize("scale", [1.3, 2.0])
def test_boxes_off_their_markers_or_twice_too_large_start_right(seed: int, scale: float) -> None:
    pool = Pool(tail(1.5, bend=0.6), (320, 340))
    angle = np.random.default_rng(seed).uniform(0, 2 * np.pi, 9)
    off = 5 * np.column_stack([np.cos(angle), np.sin(angle)])
    tracker, first = MarkerTracker.begin(pool.frame(0), pool.truth(0) + off, np.full(9, 14 * scale), use_csrt=False)
    sightings = [first, *(tracker.step(luma) for luma in pool.frames(6, 1))]
    away = errors(sightings, pool.truths(6))
    assert np.isfinite(away).all()
    assert np.max(away) < 0.2


def test_a_box_on_empty_water_takes_no_spot_of_a_marker() -> None:
    pool = Pool(still((60, 60), (100, 60)), (240, 120), texture=2.0)
    centre = np.vstack([pool.truth(0), [180.0, 60.0]])
    tracker, first = MarkerTracker.begin(pool.frame(0), centre, np.full(3, 18.0), use_csrt=False)
    sightings = [first, *(tracker.step(luma) for luma in pool.frames(10, 1))]
    assert np.isfinite(errors(sightings, np.broadcast_to(centre, (10, 3, 2)))[:, :2]).all()
    taken = [np.linalg.norm(s.position_px[2] - pool.truth(0), axis=1).min() for s in sightings]
    assert min(taken) > 7


def crossing(offset: float, speed: float, seed: int) -> Pool:
    """Two markers that pass each other at some distance in frame 25, and two that stand."""

    def path(frame: float) -> np.ndarray:
        ahead = (frame - 25) * speed
        return np.array([[140 + ahead, 90.0], [140 - ahead, 90.0 + offset], [40, 40], [240, 40]])

    return Pool(path, (280, 150), seed=seed)


@pytest.mark.parametrize("seed", [*range(4), *later(*range(4, 10))])
def test_two_markers_that_cross_are_separated_or_flagged_at_once(seed: int) -> None:
    """Where they hide each other nothing but motion tells them apart: then one is unseen or doubted while they do."""
    rng = np.random.default_rng(seed)
    offset, speed = rng.uniform(0, 12), rng.uniform(1, 4)
    pool = crossing(offset, speed, seed)
    sightings, truth = pool.followed(50, one_body=False), pool.truths(50)
    end = np.linalg.norm(sightings[-1].position_px - truth[-1], axis=1)
    confidence = np.stack([s.confidence for s in sightings])
    met = np.abs(np.arange(50) - 25) * 2 * speed < 14
    assert end.max() < 0.5 or confidence[met, :2].min() < 0.35
    if offset > 4:
        assert end.max() < 0.5, "a crossing in which both stay visible must not exchange them"


@pytest.mark.parametrize("apart", [13.0, 16.0, 22.0])
def test_a_glint_next_to_a_marker_does_not_draw_its_centre(apart: float) -> None:
    glint = Thing(lambda _: np.array([100.0 + apart, 60.0]), 14.0, WATER + 110, (5, 15))
    pool = Pool(still((60, 60), (100, 60), (60, 100)), (180, 140), things=(glint,))
    away = errors(pool.followed(16), pool.truths(16))
    assert np.isfinite(away).all()
    assert np.max(away) < 0.6


@pytest.mark.parametrize(("diameter", "luma"), [(5.0, 240.0), (60.0, 200.0)])
def test_a_glint_that_is_larger_or_smaller_than_a_marker_does_not_steal_it(diameter: float, luma: float) -> None:
    path = tail(1.0, 24.0, 0.5, 5, (60, 80))
    glint = Thing(lambda f: path(15)[2] + [(f - 15) * 5.0, 10.0 + diameter / 2], diameter, luma)
    pool = Pool(path, (240, 160), things=(glint,))
    away = errors(pool.followed(40), pool.truths(40))
    assert np.isfinite(away[-1]).all()
    assert np.max(away[-1]) < 0.3


@pytest.mark.parametrize("use_csrt", [*later(False), True])
@pytest.mark.parametrize("at", [*later(10), 30, *later(38)])  # before, in and after a loss
def test_a_restored_tracker_goes_on_bit_for_bit(use_csrt: bool, at: int) -> None:
    path = tail(2.0)
    pool = Pool(path, (320, 340), things=(Thing(lambda f: path(f)[6], (24.0, 24.0), WATER, (20, 34)),))
    tracker = pool.begun(use_csrt)[0]
    for luma in pool.frames(at, 1):
        tracker.step(luma)
    assert tracker.can_be_kept
    kept = {name: value.copy() for name, value in tracker.state().items()}
    other = MarkerTracker.restored(kept)
    for luma in pool.frames(45, at):
        here, there = tracker.step(luma), other.step(luma)
        for name in ("position_px", "seen", "confidence", "diameter_px", "contrast", "by_csrt"):
            assert np.array_equal(getattr(here, name), getattr(there, name), equal_nan=True)


def test_dark_markers_and_bright_ones_are_followed_in_one_picture() -> None:
    pool = Pool(tail(2.0), (320, 340), contrast=np.where(np.arange(9) % 2, -80.0, 110.0).tolist())
    away = errors(pool.followed(30), pool.truths(30))
    assert np.isfinite(away).all()
    assert rms_axis(away) < 0.05
