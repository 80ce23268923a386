"""The posterior of drawn sessions holds the truth whatever the seed, its bands hold what is measured, and what a
further swim is forecast to narrow comes true.
"""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.posterior.truth import STEP, DrawnSession, draw_session
from fitting.posterior import Posterior, further_trial, sample_posterior
from fitting.posterior.further_trial import further_trials
from fitting.posterior.predictive import PredictedTrial, predict_sweep, predict_trials, steady_speed
from tests.fitting.posterior.conftest import HELD_OUT_HZ

pytestmark = pytest.mark.long

SEEDS = (20, 21, 22, 23)


def test_it_holds_the_truth(drawn: DrawnSession, posterior: Posterior) -> None:
    truth, draws = np.array(drawn.truth), posterior.coefficients
    assert (np.abs(draws.mean(axis=0) - truth) < 3.3 * draws.std(axis=0)).all()
    deviation = draws.mean(axis=0) - truth
    assert deviation @ np.linalg.solve(np.cov(draws.T), deviation) < 20.5  # chi-square of five, 0.1 %
    assert posterior.misfit_p > 0.01
    assert not {"emulator_off", "not_converged", "model_discrepancy"} & {flag.kind for flag in posterior.flags}


def test_the_simulated_likelihood_answers_as_the_emulated_one(posterior: Posterior) -> None:
    chosen = np.random.default_rng(0).choice(len(posterior.coefficients), 1500, replace=False)
    draws, discrepancy = posterior.coefficients[chosen], posterior.discrepancy[chosen]
    found = posterior.found
    gaits = posterior.model.simulated(draws) + found.step_shift(draws)
    log_weight = found.likelihood.of_gaits(gaits, discrepancy) - found.likelihood(draws, discrepancy)
    weight = np.exp(log_weight - log_weight.max())
    weight /= weight.sum()
    assert 1 / (weight**2).sum() > 1000
    mean, sd = draws.mean(axis=0), draws.std(axis=0)
    exact = weight @ draws
    assert (np.abs(exact - mean) < 0.1 * sd).all()
    assert np.sqrt(weight @ (draws - exact) ** 2) == pytest.approx(sd, rel=0.1)


def test_the_forecast_comes_true(drawn: DrawnSession, posterior: Posterior, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(further_trial, "FREQUENCIES_HZ", np.array([HELD_OUT_HZ]))
    monkeypatch.setattr(further_trial, "SECONDS", 4.0)  # of a trial of 5 s, less the warm-up
    told = further_trials(posterior, drawn.twin)
    made = sample_posterior([*drawn.trials, *drawn.held_out], drawn.twin, effective=400, seed=0)
    ratio = told.sd[0] / made.coefficients.std(axis=0)
    assert (told.sd[0] < told.sd_now).all()
    assert np.exp(np.log(ratio).mean()) == pytest.approx(1.0, abs=0.25)
    assert (np.abs(np.log(ratio)) < np.log(1.6)).all()


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
