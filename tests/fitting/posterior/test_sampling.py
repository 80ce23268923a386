"""The emulator finds the posterior, and the sampler draws from it, where that is known, from a wrong start too."""

from __future__ import annotations

import numpy as np
import pytest

from fitting.posterior.posterior import Posterior, sample_posterior
from fitting.posterior.sampling import R_HAT, fit_surrogate
from tests.cases import later
from tests.fitting.posterior.linear import linear_mode


def drawn(off_sd: float, progress: list[tuple[str, float | None]]) -> tuple[Posterior, np.ndarray, np.ndarray]:
    mode, mean, covariance = linear_mode(0, off_sd)
    return sample_posterior(mode, 200, 1, lambda said, share: progress.append((said, share))), mean, covariance


@pytest.mark.parametrize("off_sd", [4.0, *later(0.0)])
def test_draws_are_those_of_the_known_posterior_and_enough(off_sd: float) -> None:
    progress: list[tuple[str, float | None]] = []
    posterior, mean, covariance = drawn(off_sd, progress)
    draws, sd = posterior.draws, np.sqrt(np.diag(covariance))
    roots = np.sqrt(posterior.coefficients)
    assert posterior.surrogate.settled
    assert (np.abs(roots.mean(axis=0) - mean) < 0.15 * sd).all()
    assert roots.std(axis=0) == pytest.approx(sd, rel=0.1)
    assert np.corrcoef(roots.T) == pytest.approx(covariance / np.outer(sd, sd), abs=0.1)
    assert draws.ess_bulk[:5].min() >= 200
    assert draws.r_hat[:5].max() <= R_HAT
    assert 0.1 < draws.acceptance < 0.9
    assert not draws.flags
    assert bool(posterior.outside) == (off_sd > 0)
    assert ("fit_outside" in [flag.kind for flag in posterior.flags]) == (off_sd > 0)
    said, share = progress[-1]
    assert said.startswith(f"sampling: {draws.ess_bulk[:5].min():.0f} effective draws, R-hat ")
    assert share is not None
    assert 0 < share < 1


@pytest.mark.parametrize("edge_sd", [0.7, 2.0, np.inf])
def test_few_twins_start_from_rest_unless_one_swims_backward(edge_sd: float) -> None:
    mode, mean, covariance = linear_mode(0)
    sd, asked = float(np.sqrt(covariance[0, 0])), []

    def swim_forward(points: np.ndarray) -> np.ndarray:
        asked.append(len(points))
        return np.sqrt(points[:, 0]) > mean[0] - edge_sd * sd

    mode.model.swim_forward = swim_forward  # type: ignore[method-assign]
    surrogate = fit_surrogate(mode, 1)
    there = np.tile(mode.coefficients, (2, 1))
    there[:, 0] = (mean[0] + sd * np.array([-3.0, 3.0])) ** 2
    behind, ahead = np.exp(surrogate.prior.log_probability(there))

    assert ahead > 0.9
    assert behind > 0.9 if edge_sd == np.inf else behind < 0.2
    assert sum(asked) < 0.5 * surrogate.simulations if edge_sd == np.inf else sum(asked) == surrogate.simulations


@pytest.mark.long
def test_intervals_hold_the_truth_about_as_often_as_they_say() -> None:
    from tests.fitting.posterior.linear import TRUTH

    held = []
    for seed in range(40):
        draws = sample_posterior(linear_mode(seed)[0], 100, seed).coefficients
        low, high = np.quantile(draws, [0.05, 0.95], axis=0)
        held.append((low <= TRUTH) & (high >= TRUTH))
    assert 0.84 < np.mean(held) < 0.96
