"""The likelihood is a multivariate normal, however it is computed."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from fitting.posterior.emulator import fit_emulator
from fitting.posterior.gait import HARMONICS
from fitting.posterior.likelihood import Discrepancy, Likelihood, wave_discrepancy
from tests.fitting.posterior.waves import ALONG_M, cruising, reader

LENGTH, TRIALS = 24, 2


@pytest.fixture(scope="module")
def likelihood() -> Likelihood:
    """Of a row of two trials, with an emulator of numbers without a meaning."""
    random = np.random.default_rng(0)
    known, half = random.standard_normal((2, LENGTH, LENGTH))
    speed = np.zeros((LENGTH, TRIALS))
    speed[0, 0], speed[LENGTH // 2, 1] = 2.0, 3.0
    points = random.uniform(2.0, 4.0, (120, 5))
    gaits = points @ random.standard_normal((5, LENGTH))
    measured = gaits.mean(axis=0) + random.standard_normal(LENGTH)
    wave = half[:, :5] @ half[:, :5].T  # of low rank, as where means do not count
    return Likelihood(
        measured,
        known @ known.T + 0.1 * np.eye(LENGTH),
        Discrepancy(wave, speed),
        fit_emulator(points, gaits, np.ones(120)),
    )


@pytest.mark.parametrize("wave", [1e-3, 0.05, 1.0])
@pytest.mark.parametrize("speed", [1e-3, 0.05, 1.0])
def test_it_is_a_dense_normal_with_both_discrepancies(likelihood: Likelihood, wave: float, speed: float) -> None:
    gaits = likelihood.measured + np.random.default_rng(1).standard_normal((6, LENGTH))
    discrepancy = np.tile([wave, speed], (6, 1))
    dense = multivariate_normal(likelihood.measured, likelihood.covariance(discrepancy[0])).logpdf(gaits)
    ours = likelihood.of_gaits(gaits, discrepancy) - 0.5 * LENGTH * np.log(2 * np.pi)
    assert ours == pytest.approx(dense, rel=1e-7)
    direct = likelihood.known + wave**2 * likelihood.discrepancy.wave
    direct = direct + speed**2 * likelihood.discrepancy.speed @ likelihood.discrepancy.speed.T
    assert likelihood.covariance(discrepancy[0]) == pytest.approx(direct)


def test_by_the_emulator_it_is_that_of_the_emulated_gaits(likelihood: Likelihood) -> None:
    random = np.random.default_rng(2)
    points, discrepancy = random.uniform(2.5, 3.5, (8, 5)), random.uniform(0.01, 0.5, (8, 2))
    expected = likelihood.of_gaits(likelihood.emulator(points), discrepancy)
    assert likelihood(points, discrepancy) == pytest.approx(expected, rel=1e-9)


def test_it_says_nothing_of_what_was_never_simulated(likelihood: Likelihood) -> None:
    assert likelihood(np.full((1, 5), 9.5), np.full((1, 2), 0.1)) == -np.inf


def test_a_wave_that_is_off_is_off_by_its_size_and_alike_nearby() -> None:
    gait = reader()(cruising())
    total = wave_discrepancy(gait, ALONG_M)
    first = np.arange(1, len(gait)).reshape(-1, 2, 1 + 2 * HARMONICS)[:, 1, 1]  # cosine across
    sd = np.sqrt(np.diag(total)[first])
    assert sd[-1] == pytest.approx(0.05 / np.sqrt(2), rel=1e-6)
    likeness = total[np.ix_(first, first)] / np.outer(sd, sd)
    assert likeness[-1, -2] > 0.6 > likeness[-1, 2] > 0
    assert (np.diag(total)[np.arange(1, len(gait)).reshape(-1, 2, 7)[..., 0]] == 0).all()
    assert np.linalg.eigvalsh(total).min() > -1e-12
