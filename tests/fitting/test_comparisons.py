"""What each comparison forgives: "shape" a path that drifts, "published" nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fitting import Comparison, MeasuredTrial
from fitting.objective import Swims
from synthetic import PLAUSIBLE_COEFFICIENTS
from tests.fitting.exact_swims import PHASES, exact_swims, exact_twin
from tracking import HeadFrame

HZ = (0.7, 1.2)
POINT = np.array([*PLAUSIBLE_COEFFICIENTS, *PHASES[: len(HZ)]])[:, None]


@pytest.fixture(scope="module")
def trials() -> tuple[MeasuredTrial, ...]:
    return exact_swims(hz=HZ, seconds=4.0, noise_m=0.7e-3)


def drifting(trial: MeasuredTrial, velocity_m_s: tuple[float, float]) -> MeasuredTrial:
    """As if the pool had a current."""
    head = trial.head
    path = head.path_m + trial.time_s[:, None] * velocity_m_s
    return replace(trial, head=HeadFrame(head.shape_m + path[:, None], head.shape_m, path, head.heading_rad))


def distance(trials: tuple[MeasuredTrial, ...], comparison: Comparison) -> float:
    return float(Swims(exact_twin(), trials, comparison).mean_distance(POINT)[0])


def test_shape_does_not_see_a_path_that_drifts(trials: tuple[MeasuredTrial, ...]) -> None:
    carried = tuple(drifting(trial, (0.02, -0.03)) for trial in trials)

    assert distance(carried, "shape") == distance(trials, "shape")
    assert distance(carried, "published") > distance(trials, "published") + 0.02
