"""How far boxes sit off their markers is found from where markers are in the mean, and from nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from fitting.posterior.box_size import BOX_SD_M, box_size, mean_places
from fitting.posterior.session_model import Disturbances

MARKERS, TRIALS = 9, 2
LENGTH = TRIALS * (1 + 14 * MARKERS)
MEANS = mean_places(LENGTH, TRIALS)


@pytest.fixture(scope="module")
def disturbed() -> Disturbances:
    """Boxes move their own means; the fish may be anywhere, and noise is small."""
    boxes = np.eye(LENGTH)[:, MEANS]
    place = np.zeros((LENGTH, 2 * TRIALS))
    for number in range(2 * TRIALS):
        place[MEANS.reshape(TRIALS, MARKERS, 2)[number // 2, :, number % 2], number] = 0.05
    return Disturbances(1e-8 * np.eye(LENGTH), place, boxes, np.zeros((LENGTH, 0)))


def drawn(box_sd_m: float, seed: int) -> np.ndarray:
    """(k,) of fish somewhere, with boxes that far off."""
    random, left = np.random.default_rng(seed), np.zeros(LENGTH)
    where = 0.05 * random.standard_normal((TRIALS, 1, 2))
    left[MEANS] = (where + box_sd_m * random.standard_normal((TRIALS, MARKERS, 2))).ravel()
    return left + 1e-4 * random.standard_normal(LENGTH)


@pytest.mark.parametrize("box_sd_m", [0.001, 0.002, 0.006])
def test_the_size_of_boxes_is_recovered(disturbed: Disturbances, box_sd_m: float) -> None:
    found = [box_size(drawn(box_sd_m, seed), TRIALS, disturbed) for seed in range(20)]
    assert np.exp(np.mean(np.log(found))) == pytest.approx(box_sd_m, rel=0.1)
    assert np.std(np.log(found)) < 0.25


def test_a_beat_that_the_twin_misses_does_not_pass_for_boxes(disturbed: Disturbances) -> None:
    left = drawn(0.002, 0)
    worse = left + 0.05
    worse[MEANS] = left[MEANS]
    assert box_size(worse, TRIALS, disturbed) == pytest.approx(box_size(left, TRIALS, disturbed))


def test_with_nothing_to_tell_it_by_the_size_is_that_of_the_prior(disturbed: Disturbances) -> None:
    silent = disturbed._replace(per_box=np.zeros((LENGTH, 0)))
    assert box_size(np.zeros(LENGTH), TRIALS, silent) == pytest.approx(BOX_SD_M, rel=0.02)


def test_means_stand_first_of_each_marker_and_axis() -> None:
    assert mean_places(29, 1).tolist() == [1, 8, 15, 22]
    assert mean_places(58, 2).tolist() == [1, 8, 15, 22, 30, 37, 44, 51]
