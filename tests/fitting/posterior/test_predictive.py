"""Bands hold what is measured about as often as they say, in trials that were fitted and in one that was not."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.posterior.truth import STEP, DrawnSession, draw_session
from fitting.posterior import Posterior, sample_posterior
from fitting.posterior.predictive import PredictedTrial, predict_sweep, predict_trials, steady_speed

pytestmark = pytest.mark.long

SEEDS = (20, 21, 22, 23)


@pytest.fixture(scope="module")
def predicted() -> list[PredictedTrial]:
    """Three trials of each of several sessions."""
    trials: list[PredictedTrial] = []
    for seed in SEEDS:
        drawn = draw_session(seed, held_out_hz=(0.85,))
        posterior = sample_posterior(drawn.trials, drawn.twin, effective=100, seed=seed)
        trials += predict_trials(posterior, [*drawn.trials, *drawn.held_out], drawn.twin)
    return trials


@pytest.mark.parametrize("role", ["fit", "holdout"])
def test_nine_tenths_of_the_harmonics_lie_in_their_bands(predicted: list[PredictedTrial], role: str) -> None:
    inside = [trial.inside for trial in predicted if trial.role == role]
    assert 0.84 < np.mean(inside) < 0.96


def test_speeds_lie_in_their_bands(predicted: list[PredictedTrial]) -> None:
    assert sum(trial.speed_inside for trial in predicted) >= len(predicted) - 3


def test_the_sweep_passes_where_the_truth_swims(posterior: Posterior, drawn: DrawnSession) -> None:
    hz = np.array([0.6, 1.0, 1.3])
    sweep = predict_sweep(posterior, drawn.twin, hz)
    swam = drawn.twin.of_robot(drawn.robot).at_step(STEP * drawn.twin.scene.timestep_s)
    true = steady_speed(swam, np.array(drawn.truth)[None], hz, sweep.inner[2])[0]
    assert (sweep.outer[0] <= true).all()
    assert (true <= sweep.outer[-1]).all()
    assert (sweep.outer[0] <= sweep.inner[0]).all()
    assert (sweep.inner[-1] <= sweep.outer[-1]).all()
