"""Where boxes were put is found again from the shape of the fish, with errors that are what they claim."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fitting import MeasuredTrial
from fitting.placement import BOX_SD_M, MARKER_SD_M, BoxesOff, Placement, place
from tests.fitting.exact_swims import exact_swims, lasting_noise

HZ = (0.9, 1.3)
PARTS = ("position_m", "shape_m", "path_m", "heading_rad")
BOXES = {"f0.90": BoxesOff(0.002, 0.004, -0.003, -0.004), "f1.30": BoxesOff(-0.002, -0.003, 0.002, 0.004)}


@pytest.fixture(scope="module")
def trials() -> tuple[MeasuredTrial, ...]:
    """Swims of the twin without noise: what they measured is what it does."""
    return exact_swims(hz=HZ, seconds=6.0)


NO_SD = {name: BoxesOff() for name in BOXES}


@pytest.fixture(scope="module")
def truth(trials: tuple[MeasuredTrial, ...]) -> Placement:
    marker_m = np.zeros((len(trials[0].markers), 2))
    marker_m[trials[0].markers.index("dorsal_fin")] = -0.02, 0.005
    marker_m[trials[0].markers.index("tail_3")] = 0.004, -0.008
    return Placement(BOXES, NO_SD, marker_m, np.zeros_like(marker_m))


def misplaced(trial: MeasuredTrial, truth: Placement, noise_m: np.ndarray | float = 0.0) -> MeasuredTrial:
    seen = truth.seen(trial, trial.head)
    return replace(trial, head=replace(seen, shape_m=seen.shape_m + noise_m))


def test_misplaced_boxes_and_markers_are_found_again(trials: tuple[MeasuredTrial, ...], truth: Placement) -> None:
    """To within what the priors hold back, least where trials differ: what all share may be boxes or markers."""
    measured = [misplaced(trial, truth) for trial in trials]
    found = place(measured, [trial.head for trial in trials])
    slow, fast = (found.boxes[name] for name in BOXES)

    assert slow.turn_rad - fast.turn_rad == pytest.approx(0.015 / 0.142, rel=0.06)
    assert slow.scale - fast.scale == pytest.approx(0.009 / 0.142, rel=0.06)
    dorsal, tail = (trials[0].markers.index(name) for name in ("dorsal_fin", "tail_3"))
    assert found.marker_m[dorsal] - found.marker_m[tail] == pytest.approx([-0.024, 0.013], abs=0.004)
    for seen, trial in zip(measured, trials, strict=True):
        assert np.abs(found.seen(trial, trial.head).shape_m - seen.head.shape_m).max() < 0.002
        assert np.abs(trial.head.shape_m - seen.head.shape_m).max() > 0.02


def test_its_intervals_hold_the_truth_as_often_as_they_claim(trials: tuple[MeasuredTrial, ...]) -> None:
    """Of truths as the priors have them; errors of 3 mm that last a fifth of a second; 90 %."""
    simulated, random = [trial.head for trial in trials], np.random.default_rng(3)
    shape, free = trials[0].head.shape_m.shape, slice(2, None)
    boxes_held, markers_held = [], []
    for _ in range(30):
        boxes = {name: BoxesOff(*BOX_SD_M * random.standard_normal(4)) for name in BOXES}
        marker_m = MARKER_SD_M * random.standard_normal(shape[1:])
        marker_m[:2] = 0.0
        truth = Placement(boxes, NO_SD, marker_m, np.zeros_like(marker_m))
        noise = 0.003 * lasting_noise((2, *shape), random, 0.2)
        found = place([misplaced(t, truth, each) for t, each in zip(trials, noise, strict=True)], simulated)
        for name, own in boxes.items():
            off = np.abs(np.array(found.boxes[name]) - own)
            boxes_held.append(off < 1.645 * np.array(found.boxes_sd[name]))
        markers_held.append(np.abs(found.marker_m - marker_m)[free] < 1.645 * found.marker_sd_m[free])
    assert 0.8 < np.mean(boxes_held) < 0.98
    assert np.mean(markers_held) > 0.8  # they go together, so thirty draws tell little of them
