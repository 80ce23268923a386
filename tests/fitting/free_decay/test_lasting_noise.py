"""Regression under lasting noise: the noise is found, and the intervals hold what they should."""

from __future__ import annotations

import numpy as np
import pytest

from fitting.lasting_noise import LastingNoise, RegressionProblem, regress, whitened
from swimsynth.disturbances import TrackingNoise, lasting_errors
from tests.cases import later

TIME_S = np.arange(80) / 60.0
TRUTH = np.array([2.0, -1.0])


def problem(seed: int, correlation_s: float = 0.1, shared: float = 0.0) -> RegressionProblem:
    random = np.random.default_rng(seed)
    jacobian = np.stack([np.sin(8 * TIME_S), TIME_S], axis=-1)[:, None] * np.array([1.0, 0.7, 0.4])[:, None] * 1e-2
    noise = TrackingNoise(sd_px=0.5e-3, correlation_s=correlation_s)
    error = lasting_errors((80, 3), 1 / 60, noise, random)
    error = (1 - shared) * error + shared * lasting_errors((80, 1), 1 / 60, noise, random)
    return RegressionProblem(
        TIME_S, np.ones((80, 3), bool), jacobian @ TRUTH + error, jacobian, np.zeros(2), np.zeros(2)
    )


def test_errors_that_last_are_reported_from_white_ones() -> None:
    lasting = [regress(problem(seed)).noise for seed in range(8)]
    white = [regress(problem(seed, correlation_s=0.0)).noise for seed in range(8)]

    assert 0.04 <= np.median([noise.duration_s for noise in lasting]) <= 0.2
    assert np.median([noise.duration_s for noise in white]) <= 0.02
    assert np.median([noise.sd_m for noise in white]) == pytest.approx(0.5e-3, rel=0.15)


@pytest.mark.parametrize("shared", later(0.0, 1.0))
def test_intervals_cover_also_where_markers_share_their_errors(shared: float) -> None:
    covered = []
    for seed in range(120):
        result = regress(problem(seed, shared=shared))
        covered.append(np.abs(result.step - TRUTH) < 1.96 * np.sqrt(np.diag(result.covariance)))

    assert np.all(np.mean(covered, axis=0) > 0.85)


def test_whitened_noise_is_white_and_gaps_are_left_out() -> None:
    used = np.ones((80, 3), bool)
    used[20:40, 1] = False
    series = lasting_errors((80, 3, 200), 1 / 60, TrackingNoise(sd_px=1.0), np.random.default_rng(0))

    white, _ = whitened(TIME_S, used, series, LastingNoise(0.1, 0.0, 1.0))

    assert white[~used].any() == np.False_
    assert white[used].std() == pytest.approx(1.0, rel=0.02)
    assert (white[1:, 0] * white[:-1, 0]).mean() == pytest.approx(0.0, abs=0.03)
