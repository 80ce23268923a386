"""The published search finds the point that made the run, and its surface is the published distance."""

from __future__ import annotations

import numpy as np
import pytest

from fitting.crank_surface import CrankGrid, ErrorSurface, distance_at, error_surface, lowest_point
from tests.fitting.dry_run.runs import NOISELESS, dry_trial, shared_response

COARSE = CrankGrid(speeds=21, phases=30)


def test_each_cell_is_the_mean_marker_distance_there() -> None:
    trial, response = dry_trial(), shared_response()
    surface = error_surface(trial, response, COARSE)

    for i, j, k in [(0, 0, 0), (6, 10, 5), (12, 20, 29)]:
        direct = distance_at(
            trial, response, float(surface.arm_m[i]), float(surface.hz[j]), float(surface.phase_rad[k])
        )
        assert surface.distance_m[i, j, k] == pytest.approx(direct, abs=1.5e-4)  # read from every second frame


@pytest.mark.parametrize(("arm_m", "hz", "phase_rad"), [(0.0382, 0.6, 1.0), (0.034, 1.19, 5.5)])
def test_without_noise_the_lowest_point_is_the_truth(arm_m: float, hz: float, phase_rad: float) -> None:
    trial = dry_trial(arm_m, hz, phase_rad, noise=NOISELESS)
    surface = error_surface(trial, shared_response(), COARSE)
    best = lowest_point(trial, shared_response(), surface)

    assert best.arm_m == pytest.approx(arm_m, abs=1e-4)
    assert best.hz == pytest.approx(hz, rel=1e-3)
    assert np.degrees(best.phase_rad - phase_rad) == pytest.approx(0.0, abs=1.0)
    assert best.distance_m < 2e-4


def hills(*depths: tuple[tuple[int, int, int], float]) -> ErrorSurface:
    """A plain with a pit of each depth."""
    distance = np.full((6, 8, 10), 0.05)
    for cell, depth in depths:
        distance[cell] = depth
    return ErrorSurface(np.linspace(0.03, 0.04, 6), np.linspace(0.5, 0.7, 8), np.arange(10) * 0.2 * np.pi, distance)


def test_valleys_come_deepest_first_and_phase_runs_round() -> None:
    surface = hills(((1, 2, 0), 0.010), ((1, 2, 9), 0.012), ((4, 5, 5), 0.011))
    depths = [cell.distance_m for cell in surface.valleys(2)]

    assert depths == [0.010, 0.011]  # the last phase is next to the first
