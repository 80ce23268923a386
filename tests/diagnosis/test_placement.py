"""How far boxes and markers are off is found from where markers are in the mean, and from nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.constants import TAKEN, mean_places, placement_uncertainty
from fitting.session_model import NuisanceModel, PlacementUncertainty

MARKERS, TRIALS = 9, 2
LENGTH = TRIALS * (1 + 14 * MARKERS)
MEANS = mean_places(LENGTH, TRIALS)


@pytest.fixture(scope="module")
def disturbed() -> NuisanceModel:
    """Boxes move their own means, markers those of both trials; the fish may be anywhere, and noise is small."""
    boxes = np.eye(LENGTH)[:, MEANS]
    place = np.zeros((LENGTH, 2 * TRIALS))
    for number in range(2 * TRIALS):
        place[MEANS.reshape(TRIALS, MARKERS, 2)[number // 2, :, number % 2], number] = 0.05
    markers = boxes.reshape(LENGTH, TRIALS, -1).sum(axis=1)
    return NuisanceModel(1e-8 * np.eye(LENGTH), place, boxes, markers, np.zeros((LENGTH, 0)))


def drawn(off: PlacementUncertainty, seed: int) -> np.ndarray:
    """(k,) of fish somewhere, with boxes and markers that far off."""
    random, left = np.random.default_rng(seed), np.zeros(LENGTH)
    where = 0.05 * random.standard_normal((TRIALS, 1, 2))
    boxes = off.box_m * random.standard_normal((TRIALS, MARKERS, 2))
    left[MEANS] = (where + boxes + off.marker_m * random.standard_normal((MARKERS, 2))).ravel()
    return left + 1e-4 * random.standard_normal(LENGTH)


@pytest.mark.parametrize(
    "off", [PlacementUncertainty(0.002, 0.001), PlacementUncertainty(0.006, 0.001), PlacementUncertainty(0.004, 0.011)]
)
def test_both_sizes_are_recovered(disturbed: NuisanceModel, off: PlacementUncertainty) -> None:
    """That of markers less well, and held back by its prior, where boxes are off by more than they are."""
    found = np.log([placement_uncertainty(drawn(off, seed), TRIALS, disturbed) for seed in range(20)])
    box_m, marker_m = np.exp(found.mean(axis=0))
    assert box_m == pytest.approx(off.box_m, rel=0.12)
    assert marker_m == pytest.approx(off.marker_m, rel=0.35)
    assert found.std(axis=0)[0] < 0.25


def test_a_beat_that_the_twin_misses_does_not_pass_for_boxes(disturbed: NuisanceModel) -> None:
    left = drawn(TAKEN, 0)
    worse = left + 0.05
    worse[MEANS] = left[MEANS]
    assert placement_uncertainty(worse, TRIALS, disturbed) == pytest.approx(
        placement_uncertainty(left, TRIALS, disturbed)
    )
