"""Which derivative of the tail's tip is nearer the truth on boxes that lie on half pixels, and where that ends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fitting import TailSwim, published_motion, smoothed_motion
from tests.fitting.tails import PIXEL_M, on_half_pixels
from tests.fitting.test_ebt import swim


def bias(hz: float, amplitude: float, seeds: int = 8, jitter_px: float = 0.3) -> tuple[float, float]:
    """Relative bias of <h_t^2> by finite differences and by smoothing, over boxes that jitter on a half-pixel grid."""
    true = (2 * np.pi * hz * amplitude) ** 2 / 2
    clean = swim(hz, amplitude)
    found = []
    for seed in range(seeds):
        boxes = seen(clean, jitter_px, np.random.default_rng(seed))
        found.append([float(motion(boxes).lateral_speed_sq) for motion in (published_motion, smoothed_motion)])
    published, smoothed = np.mean(found, axis=0) / true - 1
    return float(published), float(smoothed)


def seen(clean: TailSwim, jitter_px: float, random: np.random.Generator) -> TailSwim:
    jitter = jitter_px * PIXEL_M * random.normal(size=clean.tip_m.shape)
    return replace(clean, tip_m=on_half_pixels(clean.tip_m + jitter))


@pytest.mark.parametrize(("hz", "amplitude"), [(0.3, 0.03), (0.4, 0.03), (0.4, 0.06), (0.5, 0.04)])
def test_at_slow_beats_smoothing_takes_away_most_of_the_bias_of_finite_differences(hz: float, amplitude: float) -> None:
    published, smoothed = bias(hz, amplitude)

    assert published > 0.04
    assert abs(smoothed) < 0.25 * published


def test_finite_differences_of_the_slowest_swims_are_off_by_most_of_the_truth() -> None:
    published, smoothed = bias(0.4, 0.015)

    assert published > 0.8
    assert abs(smoothed) < 0.1


def test_at_fast_beats_smoothing_takes_some_of_the_beat_itself() -> None:
    """So that a fit over all speeds bends: the price, known and stated."""
    published, smoothed = bias(1.3, 0.06)

    assert abs(published) < 0.01
    assert smoothed == pytest.approx(-0.107, abs=0.01)
