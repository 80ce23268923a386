"""Where boxes were put is found again from the shape of the fish, with errors that are what they claim."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fitting import BoxesOff, MeasuredTrial, Placement, Swims
from fitting.placement import place, placement_sd
from synthetic import PLAUSIBLE_COEFFICIENTS
from tests.fitting.exact_swims import PHASES, exact_swims, exact_twin, lasting_noise
from tracking import to_head_frame

HZ = (0.9, 1.3)
BOXES = {"f0.90": BoxesOff(0.002, 0.004, -0.003, -0.004), "f1.30": BoxesOff(-0.002, -0.003, 0.002, 0.004)}


@pytest.fixture(scope="module")
def trials() -> tuple[MeasuredTrial, ...]:
    """Swims of the twin without noise: what they measured is what it does."""
    return exact_swims(hz=HZ, seconds=6.0)


@pytest.fixture(scope="module")
def truth(trials: tuple[MeasuredTrial, ...]) -> Placement:
    marker_m = np.zeros((len(trials[0].markers), 2))
    marker_m[trials[0].markers.index("dorsal_fin")] = -0.02, 0.005
    marker_m[trials[0].markers.index("tail_3")] = 0.004, -0.008
    return Placement(BOXES, marker_m)


def misplaced(trial: MeasuredTrial, truth: Placement, noise_m: np.ndarray | float = 0.0) -> MeasuredTrial:
    seen = truth.seen(trial, trial.head)
    return replace(trial, head=replace(seen, shape_m=seen.shape_m + noise_m))


def test_the_same_bodies_need_no_placement(trials: tuple[MeasuredTrial, ...]) -> None:
    found = place(trials, [trial.head for trial in trials])

    assert np.abs(found.marker_m).max() < 1e-9
    assert np.abs(list(found.boxes.values())).max() < 1e-9


def test_a_box_off_to_one_side_turns_the_fish_to_the_other() -> None:
    """The neck's 2 mm to the right (+y, as the fish swims towards -x) makes all else seem turned to the left."""
    assert BoxesOff(neck_across=0.002).turn_rad == pytest.approx(-0.002 / 0.142, rel=1e-3)
    assert BoxesOff(neck_along=0.002).scale == pytest.approx(1 - 0.002 / 0.142)
    assert BoxesOff(nose_across=0.003).shift_m == pytest.approx([0.0, -0.003])


def test_what_the_normaliser_makes_of_misplaced_boxes_is_that_to_first_order(trials: tuple[MeasuredTrial, ...]) -> None:
    """Boxes moved on the pool, scaled by nose and neck and normalised, against the placement's own words."""
    trial, off = trials[0], BOXES["f0.90"]
    forward = -np.stack([np.cos(trial.head.heading_rad), np.sin(trial.head.heading_rad)], axis=-1)
    along, across = -forward, np.stack([forward[:, 1], -forward[:, 0]], axis=-1)
    moved = np.array(trial.position_m)
    for marker, (x, y) in enumerate((off[:2], off[2:])):
        moved[:, marker] += x * along + y * across
    moved *= 0.142 / np.median(np.linalg.norm(moved[:, 1] - moved[:, 0], axis=-1))
    told = Placement({trial.name: off}, np.zeros((len(trial.markers), 2))).seen(trial, trial.head)
    true = to_head_frame(moved, 0, 1)
    plain = np.linalg.norm(true.shape_m[:, 2:] - trial.head.shape_m[:, 2:], axis=-1).mean()

    assert np.linalg.norm(told.shape_m[:, 2:] - true.shape_m[:, 2:], axis=-1).mean() < 0.1 * plain
    assert np.ptp(told.path_m[:, 1] - true.path_m[:, 1]) < 0.1 * np.ptp(true.path_m[:, 1] - trial.head.path_m[:, 1])


def test_misplaced_boxes_and_markers_are_found_again(trials: tuple[MeasuredTrial, ...], truth: Placement) -> None:
    """To within what the priors hold back, least where trials differ: what all share may be boxes or markers."""
    found = place([misplaced(trial, truth) for trial in trials], [trial.head for trial in trials])
    slow, fast = (found.boxes[name] for name in BOXES)

    assert slow.turn_rad - fast.turn_rad == pytest.approx(0.015 / 0.142, rel=0.06)
    assert slow.scale - fast.scale == pytest.approx(0.009 / 0.142, rel=0.06)
    dorsal, tail = (trials[0].markers.index(name) for name in ("dorsal_fin", "tail_3"))
    assert found.marker_m[dorsal] - found.marker_m[tail] == pytest.approx([-0.024, 0.013], abs=0.004)


def test_put_right_the_shapes_agree(trials: tuple[MeasuredTrial, ...], truth: Placement) -> None:
    measured = [misplaced(trial, truth) for trial in trials]
    found = place(measured, [trial.head for trial in trials])
    for seen, trial in zip(measured, trials, strict=True):
        left = found.seen(trial, trial.head).shape_m - seen.head.shape_m
        before = trial.head.shape_m - seen.head.shape_m
        assert np.abs(left).max() < 0.002
        assert np.abs(before).max() > 0.02


def test_known_markers_leave_a_trial_its_own_boxes(trials: tuple[MeasuredTrial, ...], truth: Placement) -> None:
    """As for a held-out trial: from two beats, the markers' places given."""
    trial = trials[0]
    two_beats = trial.time_s < 2 / HZ[0]
    measured = misplaced(trial, truth)
    spoilt = np.where(two_beats[:, None, None], measured.head.shape_m, 7.0)
    late = replace(measured, head=replace(measured.head, shape_m=spoilt))
    found = place([late], [trial.head], [two_beats], truth.marker_m)

    assert found.boxes["f0.90"].turn_rad == pytest.approx(BOXES["f0.90"].turn_rad, rel=0.06)
    assert found.boxes["f0.90"].scale == pytest.approx(BOXES["f0.90"].scale, abs=0.004)
    assert np.array_equal(found.marker_m, truth.marker_m)


def test_samples_that_are_flagged_say_nothing(trials: tuple[MeasuredTrial, ...], truth: Placement) -> None:
    measured = [misplaced(trial, truth) for trial in trials]
    first = measured[0]
    weight, shape = first.weight.copy(), first.head.shape_m.copy()
    weight[90:200, 4], shape[90:200, 4] = 0.0, 3.0
    flagged = replace(first, weight=weight, head=replace(first.head, shape_m=shape))
    simulated = [trial.head for trial in trials]
    clean, found = (
        place([replace(first, weight=weight), measured[1]], simulated),
        place([flagged, measured[1]], simulated),
    )

    np.testing.assert_allclose(found.marker_m, clean.marker_m)


def test_its_standard_errors_hold_the_truth_as_often_as_they_claim(
    trials: tuple[MeasuredTrial, ...], truth: Placement
) -> None:
    """Errors of 3 mm that last a fifth of a second; 90 % intervals by Student's t of as many beats."""
    simulated, random = [trial.head for trial in trials], np.random.default_rng(3)
    clean = place([misplaced(trial, truth) for trial in trials], simulated)
    shape = (2, *trials[0].head.shape_m.shape)
    inside = []
    for _ in range(40):
        noise = 0.003 * lasting_noise(shape, random, 0.2)
        noisy = [misplaced(trial, truth, each) for trial, each in zip(trials, noise, strict=True)]
        found, sd = place(noisy, simulated), placement_sd(noisy, simulated)
        for name, width in (("f0.90", 2.35), ("f1.30", 2.13)):
            off = np.array(found.boxes[name]) - np.array(clean.boxes[name])
            inside.append(np.abs(off) < width * np.array(sd.boxes[name]))
    share = np.mean(inside)
    assert 0.80 < share < 0.97


def test_with_boxes_put_right_the_true_coefficients_leave_nothing(
    trials: tuple[MeasuredTrial, ...], truth: Placement
) -> None:
    """The path is turned and scaled with the head frame, which shapes alone tell: nothing is left of it either."""
    measured = tuple(misplaced(trial, truth) for trial in trials)
    point = np.append(PLAUSIBLE_COEFFICIENTS, PHASES[:2])[:, None]
    plain, placed = (Swims(exact_twin(), measured, kind).mean_distance(point)[0] for kind in ("published", "placed"))

    assert plain > 0.015
    assert placed < 0.1 * plain
