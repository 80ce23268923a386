"""The posterior of a drawn session holds its truth and its fit, and its bands hold what is measured."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.posterior.truth import DrawnSession
from fitting.features import SPEED
from fitting.posterior.posterior import Posterior
from fitting.posterior.prediction import predict_sweep, predict_trials

pytestmark = pytest.mark.long

FAR_SD, HOLD = 3.5, 0.8


def test_it_holds_the_truth_and_the_fit(drawn: DrawnSession, posterior: Posterior) -> None:
    truth, draws = np.array(drawn.truth), posterior.coefficients
    assert (np.abs(draws.mean(axis=0) - truth) < FAR_SD * draws.std(axis=0)).all()
    assert not posterior.outside
    assert posterior.misfit_p > 0.01
    assert not {"emulator_off", "not_converged", "model_discrepancy"} & {flag.kind for flag in posterior.flags}


def test_the_simulated_likelihood_answers_as_the_emulated_one(posterior: Posterior) -> None:
    """Importance sampling: weights of draws by the twin itself move no interval."""
    chosen = np.random.default_rng(0).choice(len(posterior.coefficients), 200, replace=False)
    draws, sizes, likelihood = (
        posterior.coefficients[chosen],
        posterior.discrepancy[chosen],
        posterior.surrogate.likelihood,
    )
    features = posterior.mode.model.simulated(draws)
    log_weight = likelihood.of_features(features, sizes) - likelihood(draws, sizes)
    weight = np.exp(log_weight - log_weight.max())
    weight /= weight.sum()
    assert 1 / (weight**2).sum() > 100
    assert (np.abs(weight @ draws - draws.mean(axis=0)) < 0.3 * draws.std(axis=0)).all()


def test_trials_lie_within_their_bands_and_inner_bands_within_outer_ones(
    drawn: DrawnSession, posterior: Posterior
) -> None:
    trials = [*drawn.trials, *drawn.held_out]
    for measured, trial in zip(trials, predict_trials(posterior, trials), strict=True):
        assert trial.speed_inside
        assert trial.inside > HOLD
        assert not trial.flags
        assert trial.outer[0] < trial.inner[0] <= trial.inner[-1] < trial.outer[-1]
        of_turning = measured.speed - trial.speed  # slope over whole beats, against the smooth path
        assert trial.forecast.speed == pytest.approx(np.median(trial.inner) + of_turning, abs=1e-3)


def test_the_sweep_meets_the_fitted_speeds_and_one_trial_more_narrows(posterior: Posterior) -> None:
    trials = [block.model for block in posterior.mode.blocks]
    hz = np.array([model.trial.frequency.hz for model in trials])
    sweep = predict_sweep(posterior, hz)
    measured = np.array([model.measured[SPEED] for model in trials])
    assert (sweep.outer[0] - 0.01 <= measured).all()  # it starts at another speed
    assert (measured <= sweep.outer[-1] + 0.01).all()
    assert (sweep.sd < sweep.sd_now).all()
    assert (sweep.shrinkage(np.ones(5, bool)) < 1).all()
