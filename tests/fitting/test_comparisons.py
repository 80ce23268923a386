"""What each comparison forgives: "yaw" a turned head axis, "shape" a path that drifts, "published" neither."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fitting import Comparison, MeasuredTrial
from fitting.objective import Swims, best_yaw, turn
from synthetic import PLAUSIBLE_COEFFICIENTS
from tests.fitting.exact_swims import PHASES, exact_swims, exact_twin
from tracking import HeadFrame

HZ = (0.7, 1.2)
POINT = np.array([*PLAUSIBLE_COEFFICIENTS, *PHASES[: len(HZ)]])[:, None]
TURN_RAD = np.radians([5.0, -3.0])


@pytest.fixture(scope="module")
def trials() -> tuple[MeasuredTrial, ...]:
    return exact_swims(hz=HZ, seconds=4.0, noise_m=0.7e-3)


def turned(trial: MeasuredTrial, angle_rad: float) -> MeasuredTrial:
    """As if the box of the neck had been placed aside, so that the head's axis is measured turned."""
    head = trial.head
    shape, path = turn(head.shape_m, np.array(angle_rad)), turn(head.path_m, np.array(angle_rad))
    return replace(
        trial,
        head=HeadFrame(shape + path[:, None], shape, path, head.heading_rad - angle_rad),
    )


def drifting(trial: MeasuredTrial, velocity_m_s: tuple[float, float]) -> MeasuredTrial:
    """As if the pool had a current."""
    head = trial.head
    path = head.path_m + trial.time_s[:, None] * velocity_m_s
    return replace(trial, head=HeadFrame(head.shape_m + path[:, None], head.shape_m, path, head.heading_rad))


def distance(trials: tuple[MeasuredTrial, ...], comparison: Comparison) -> float:
    return float(Swims(exact_twin(), trials, comparison).mean_distance(POINT)[0])


def test_the_turn_of_each_axis_is_found_and_costs_nothing_where_free() -> None:
    straight = exact_swims(hz=HZ, seconds=4.0, noise_m=0.3e-3)
    bent = tuple(turned(trial, angle) for trial, angle in zip(straight, TURN_RAD, strict=True))
    found = Swims(exact_twin(), bent, "yaw").yaws(POINT)

    np.testing.assert_allclose(np.degrees(found), -np.degrees(TURN_RAD)[None], atol=0.2)
    assert distance(bent, "published") > 4 * distance(straight, "published")
    assert distance(bent, "yaw") == pytest.approx(distance(straight, "yaw"), rel=1e-4)


def test_the_best_yaw_undoes_any_turn_of_all_that_has_weight() -> None:
    points, angles = np.random.default_rng(0).normal(size=(30, 4, 2)), np.array([-3.0, -0.4, 0.0, 1.2])
    simulated = turn(points, angles[:, None, None])
    weight, spoilt = np.ones((30, 4)), points.copy()
    spoilt[3:9, 1], weight[3:9, 1] = 9.0, 0.0
    spoilt[12, 2] = np.nan

    np.testing.assert_allclose(best_yaw(simulated, spoilt, weight), angles, atol=1e-9)


def test_shape_does_not_see_a_path_that_drifts(trials: tuple[MeasuredTrial, ...]) -> None:
    carried = tuple(drifting(trial, (0.02, -0.03)) for trial in trials)

    assert distance(carried, "shape") == distance(trials, "shape")
    assert distance(carried, "published") > distance(trials, "published") + 0.02
