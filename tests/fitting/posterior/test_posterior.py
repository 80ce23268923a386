"""The posterior of drawn sessions holds the truth, whatever the seed, and the emulator does not change it."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.posterior.truth import DrawnSession
from fitting.posterior import Posterior, sample_posterior

pytestmark = pytest.mark.long


def test_it_holds_the_truth(drawn: DrawnSession, posterior: Posterior) -> None:
    truth, draws = np.array(drawn.truth), posterior.coefficients
    assert (np.abs(draws.mean(axis=0) - truth) < 3.3 * draws.std(axis=0)).all()
    deviation = draws.mean(axis=0) - truth
    assert deviation @ np.linalg.solve(np.cov(draws.T), deviation) < 20.5  # chi-square of five, 0.1 %
    assert posterior.misfit_p > 0.01
    assert not {"emulator_off", "not_converged", "model_discrepancy"} & {flag.kind for flag in posterior.flags}


def test_two_trials_give_the_draws_that_were_wanted(posterior: Posterior) -> None:
    assert posterior.draws.ess_bulk[:5].min() >= 400
    assert posterior.draws.r_hat[:5].max() <= 1.01
    assert posterior.draws.enough


def test_another_seed_finds_the_same(drawn: DrawnSession, posterior: Posterior) -> None:
    other = sample_posterior(drawn.trials, drawn.twin, effective=400, seed=1).coefficients
    sd = posterior.coefficients.std(axis=0)
    assert (np.abs(other.mean(axis=0) - posterior.coefficients.mean(axis=0)) < 0.3 * sd).all()
    assert other.std(axis=0) == pytest.approx(sd, rel=0.15)


def test_the_simulated_likelihood_gives_the_same_answer_as_the_emulated_one(posterior: Posterior) -> None:
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
