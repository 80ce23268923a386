"""A clamp that yields is told from tracking errors."""

from __future__ import annotations

import numpy as np
import pytest

from fitting.free_decay import measure_decay_trial
from tests.fitting.free_decay.decays import CAMERA, MARKERS, ROBOT, Truth, filmed, swings

DAMPED, LIGHT = Truth(), Truth(0.45, 0.006, seconds=2.2)


def yielding(place_m: np.ndarray, degrees_per_m: float) -> np.ndarray:
    """(n, m, 2) places of a robot that turns about its neck as its fin swings."""
    angle = np.radians(degrees_per_m) * (place_m[:, -1, 1] - place_m[-1, -1, 1])
    cos, sin, neck = np.cos(angle), np.sin(angle), place_m[:, [MARKERS.index("neck")]]
    turn = np.stack([np.stack([cos, sin], -1), np.stack([-sin, cos], -1)], axis=-2)  # (n, 2, 2), of rows
    return neck + (place_m - neck) @ turn


def flagged(place_m: np.ndarray, truth: Truth, seed: int) -> list[str]:
    flags = measure_decay_trial("decay", filmed(place_m, truth, seed), CAMERA, ROBOT).flags
    return [flag.message for flag in flags if flag.kind == "head_moves"]


@pytest.mark.parametrize("truth", [DAMPED, LIGHT])
def test_a_clamp_that_yields_is_told_from_tracking_errors(truth: Truth) -> None:
    place = swings([truth])[0]

    for seed in range(6):
        assert flagged(place, truth, seed) == []
        (message,) = flagged(yielding(place, 20.0), truth, seed)
        assert "% of the fin's swing are the head's: the clamp yields" in message
