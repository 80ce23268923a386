"""Spots answer to discs wherever they stand, and their centres are right to a fraction of a pixel."""

import numpy as np
import pytest

from tests.tracking.tracker.pool import Pool, still
from tracking.appearance import Appearance, measure_appearance
from tracking.spots import Spots, find_spots, measure_centres

DIAMETERS = (8.0, 14.0, 22.0, 30.0)


def looks_of(luma: np.ndarray, centre: np.ndarray, side: float) -> Appearance:
    return measure_appearance(luma, centre, np.full(len(centre), side))


def found_at(spots: Spots, truth: np.ndarray) -> np.ndarray:
    """(k, 2) the spot next to each true place, which must be within 2 px of it."""
    distance = np.linalg.norm(spots.position_px[:, None] - truth, axis=2)  # (c, k)
    assert (distance.min(axis=0) < 2).all(), "a marker has no spot"
    assert len(set(distance.argmin(axis=0))) == len(truth), "two markers share a spot"
    return spots.position_px[distance.argmin(axis=0)]


def centre_errors(diameter: float, contrast: float, shifts: int = 24, **pool: object) -> np.ndarray:
    """(k, 2) errors of the centre of one marker, looked for a few pixels beside it."""
    rng = np.random.default_rng(5)
    found = []
    for seed in range(shifts):
        truth = np.array([[60.0, 55.0]]) + rng.uniform(-0.5, 0.5, (1, 2))
        scene = Pool(still(*truth), (120, 110), diameter, contrast, seed=seed).but(**pool)
        luma = scene.frame(0)
        look = looks_of(luma, truth, 1.3 * diameter)
        near = truth + rng.uniform(-4, 4, (1, 2))
        spot = found_at(find_spots(luma, near, np.array([8.0]), look), truth)
        found.append(measure_centres(luma, spot, spot, look).position_px[0] - truth[0])
    return np.array(found)


@pytest.mark.parametrize("contrast", [80.0, -80.0])
@pytest.mark.parametrize("diameter", DIAMETERS)
def test_centres_are_right_to_a_twentieth_of_a_pixel_and_without_bias(diameter: float, contrast: float) -> None:
    errors = centre_errors(diameter, contrast)
    assert np.sqrt((errors**2).mean(axis=0)).max() < 0.05
    assert np.abs(errors.mean(axis=0)).max() < 0.02


@pytest.mark.parametrize("diameter", [8.0, 14.0, 22.0])
def test_a_slope_of_the_water_moves_a_centre_by_less_than_its_share(diameter: float) -> None:
    """Over its disc the slope adds a few steps of luma on one side: at most 1/30 of the marker's light."""
    errors = centre_errors(diameter, 80.0, slope=(0.15, -0.1), noise=1.0, texture=0.0)
    assert np.abs(errors.mean(axis=0)).max() < 0.035


@pytest.mark.parametrize("contrast", [80.0, -80.0])
@pytest.mark.parametrize("diameter", [8.0, 14.0, 20.0])
def test_neighbours_that_nearly_touch_stay_two_and_hardly_draw_each_other(diameter: float, contrast: float) -> None:
    rng = np.random.default_rng(7)
    towards, away = [], []
    for seed in range(24):
        angle = rng.uniform(0, 2 * np.pi)
        ahead = np.array([np.cos(angle), np.sin(angle)])
        first = np.array([80.0, 80.0]) + rng.uniform(-0.5, 0.5, 2)
        truth = np.stack([first, first + 1.1 * diameter * ahead])
        luma = Pool(still(*truth), (170, 170), diameter, contrast, seed=seed).frame(0)
        look = looks_of(luma, truth, 1.1 * diameter)
        spots = found_at(find_spots(luma, truth, np.full(2, diameter), look), truth)
        errors = measure_centres(luma, spots, spots, look).position_px - truth
        away.append(errors)
        towards += [errors[0] @ ahead, -errors[1] @ ahead]
    assert np.sqrt((np.array(away) ** 2).mean()) < 0.07
    assert abs(np.mean(towards)) < 0.08


def test_no_spot_on_water_without_markers() -> None:
    """Texture, noise and a slope, searched as if 16 markers of contrast 80 were expected there."""
    luma = Pool(still(), (200, 200), noise=3.0, texture=4.0, slope=(0.2, 0.1)).frame(0)
    where = np.stack(np.meshgrid([40, 80, 120, 160], [40, 80, 120, 160]), axis=-1).reshape(-1, 2).astype(float)
    look = Appearance(np.ones(16), np.full(16, 14.0), np.full(16, 80.0), np.ones(16))
    assert len(find_spots(luma, where, np.full(16, 30.0), look).strength) == 0


def test_a_marker_gives_strength_one_and_a_faint_one_its_share() -> None:
    truth = np.array([[60.0, 60.0], [120.0, 60.0]])
    luma = Pool(still(*truth), (180, 120), 14.0, (100.0, 50.0), noise=0.0, texture=0.0).frame(0)
    look = Appearance(np.ones(2), np.full(2, 14.0), np.full(2, 100.0), np.ones(2))
    spots = find_spots(luma, truth, np.full(2, 10.0), look)
    order = np.argsort(spots.position_px[:, 0])
    assert spots.strength[order] == pytest.approx([1.0, 0.5], abs=0.06)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("diameter", DIAMETERS)
def test_the_look_of_a_marker_is_measured_in_its_box(diameter: float, sign: float) -> None:
    truth = np.array([[60.0, 60.0]])
    luma = Pool(still(*truth), (130, 130), diameter, sign * 70.0).frame(0)
    look = looks_of(luma, truth, 1.3 * diameter)
    assert look.sign[0] == sign
    assert look.diameter_px[0] == pytest.approx(diameter, rel=0.08)
    assert look.contrast[0] == pytest.approx(70.0, rel=0.12)


def test_the_look_follows_slow_changes_but_only_so_far() -> None:
    start = Appearance(np.ones(2), np.full(2, 14.0), np.full(2, 100.0), np.ones(2))
    look = start
    for _ in range(400):
        look = look.seen(np.array([True, False]), np.full(2, 60.0), np.full(2, 5.0), start)
    assert look.diameter_px == pytest.approx([3.0 * 14.0, 14.0])
    assert look.contrast == pytest.approx([10.0, 100.0])
