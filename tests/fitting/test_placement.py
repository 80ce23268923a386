"""Offsets of boxes and markers are recovered from the shape of the fish; the intervals of markers cover."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fitting import MeasuredTrial
from fitting.placement import BOX_SD_M, MARKER_SD_M, Placement, place
from tests.fitting.exact_swims import exact_swims, lasting_noise

HZ = (0.9, 1.3)
PARTS = ("position_m", "shape_m", "path_m", "heading_rad")
BOXES_M = {"f0.90": np.array([0.002, 0.004, -0.003, -0.004]), "f1.30": np.array([-0.002, -0.003, 0.002, 0.004])}


@pytest.fixture(scope="module")
def trials() -> tuple[MeasuredTrial, ...]:
    """Swims of the twin without noise: what they measured is what it does."""
    return exact_swims(hz=HZ, seconds=6.0)


@pytest.fixture(scope="module")
def truth(trials: tuple[MeasuredTrial, ...]) -> Placement:
    marker_m = np.zeros((len(trials[0].markers), 2))
    marker_m[trials[0].markers.index("dorsal_fin")] = -0.02, 0.005
    marker_m[trials[0].markers.index("tail_3")] = 0.004, -0.008
    return Placement(BOXES_M, marker_m, np.zeros_like(marker_m))


def misplaced(trial: MeasuredTrial, truth: Placement, noise_m: np.ndarray | float = 0.0) -> MeasuredTrial:
    seen = truth.seen(trial, trial.head)
    return trial.seen_as(head=replace(seen, shape_m=seen.shape_m + noise_m))


def test_misplaced_boxes_and_markers_are_found_again(trials: tuple[MeasuredTrial, ...], truth: Placement) -> None:
    """To within what the priors hold back, least where trials differ: what all share may be boxes or markers."""
    measured = [misplaced(trial, truth) for trial in trials]
    found = place(measured, [trial.head for trial in trials])
    nose_along, nose_across, neck_along, neck_across = found.boxes_m["f0.90"] - found.boxes_m["f1.30"]

    assert nose_across - neck_across == pytest.approx(0.015, rel=0.06)  # the turn
    assert nose_along - neck_along == pytest.approx(0.009, rel=0.06)  # the scale
    dorsal, tail = (trials[0].markers.index(name) for name in ("dorsal_fin", "tail_3"))
    assert found.marker_m[dorsal] - found.marker_m[tail] == pytest.approx([-0.024, 0.013], abs=0.004)
    for seen, trial in zip(measured, trials, strict=True):
        assert np.abs(found.seen(trial, trial.head).shape_m - seen.head.shape_m).max() < 0.002
        assert np.abs(trial.head.shape_m - seen.head.shape_m).max() > 0.02


def test_intervals_of_markers_cover_the_truth(trials: tuple[MeasuredTrial, ...]) -> None:
    """Truths drawn from the priors; errors of 3 mm, correlated over a fifth of a second; 90 % intervals."""
    simulated, random = [trial.head for trial in trials], np.random.default_rng(3)
    shape, free = trials[0].head.shape_m.shape, slice(2, None)
    covered = []
    for _ in range(30):
        boxes_m = {name: BOX_SD_M * random.standard_normal(4) for name in BOXES_M}
        marker_m = MARKER_SD_M * random.standard_normal(shape[1:])
        marker_m[:2] = 0.0
        truth = Placement(boxes_m, marker_m, np.zeros_like(marker_m))
        noise = 0.003 * lasting_noise((2, *shape), random, 0.2)
        found = place([misplaced(t, truth, each) for t, each in zip(trials, noise, strict=True)], simulated)
        covered.append(np.abs(found.marker_m - marker_m)[free] < 1.645 * found.marker_sd_m[free])
    assert np.mean(covered) > 0.8  # markers are correlated, so thirty draws are few
