"""The likelihood is a multivariate normal however it is computed; white noise gives least squares."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from benchmarks.posterior.truth import DrawnSession
from fitting.model.discrepancy import Discrepancy, wave_discrepancy
from fitting.model.features import HARMONICS, Gait
from fitting.posterior import Posterior, naive
from fitting.posterior.emulator import Emulator, exponents, fit_emulator, terms
from fitting.posterior.likelihood import Likelihood
from fitting.posterior.naive import naive_posterior
from tests.fitting.posterior.waves import ALONG_M, cruising, reader


def _points(count: int, seed: int, low: float = 1.0, high: float = 4.0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(low, high, (count, 5))


def _smooth(points: np.ndarray, outputs: int = 4, degree: int = 2) -> np.ndarray:
    powers = exponents(degree)
    return terms(points, powers) @ np.random.default_rng(5).standard_normal((len(powers), outputs))


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_polynomials_in_the_roots_are_met_exactly(degree: int) -> None:
    points, fresh = _points(400, 0), _points(50, 1)
    emulator = fit_emulator(points, _smooth(points, degree=degree), np.ones(len(points)))
    assert emulator.degree >= degree
    assert emulator(fresh) == pytest.approx(_smooth(fresh, degree=degree), abs=1e-3)
    assert np.sqrt(np.diag(emulator.error)).max() < 1e-3


def test_what_it_says_it_misses_is_what_it_misses() -> None:
    random, points, fresh = np.random.default_rng(2), _points(150, 3), _points(2000, 4)
    size = np.array([0.02, 0.1, 0.3, 1.0])
    together = random.standard_normal((len(points), 1))
    rough = size * (0.6 * random.standard_normal((len(points), 4)) + 0.8 * together)
    emulator = fit_emulator(points, _smooth(points) + rough, np.ones(len(points)))
    missed = _smooth(fresh) - emulator(fresh)
    fresh_rough = size * (0.6 * random.standard_normal((len(fresh), 4)) + 0.8 * random.standard_normal((len(fresh), 1)))
    actual = np.cov((missed + fresh_rough).T)
    assert np.diag(emulator.error) / np.diag(actual) == pytest.approx(1.0, abs=0.35)
    assert np.sign(actual[0, 3]) * emulator.error[0, 3] > 0
    alike = [each[0, 3] / np.sqrt(each[0, 0] * each[3, 3]) for each in (emulator.error, actual)]
    assert alike[0] == pytest.approx(alike[1], abs=0.15)


def test_points_of_little_weight_hardly_count() -> None:
    points, weight = _points(300, 6), np.ones(300)
    gaits = _smooth(points)
    gaits[150:] += 100.0
    weight[150:] = 1e-9
    assert fit_emulator(points, gaits, weight)(points[:150]) == pytest.approx(gaits[:150], abs=1e-2)


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


SD_M = 1e-3
TRUTH = np.array([1.0, 2.0, 3.0, 4.0, 5.0])


def linear_emulator(length: int) -> Emulator:
    """Of gaits that are linear in the roots of the coefficients."""
    random = np.random.default_rng(0)
    points = random.uniform(0.2, 9.8, (200, 5))
    slopes = 0.01 * random.standard_normal((5, length))
    return fit_emulator(points, np.sqrt(points) @ slopes, np.ones(200))


def swum(read: Gait, emulator: Emulator, seed: int) -> Posterior:
    """A trial of white noise about the gait of the truth, and draws to start from."""
    noise = SD_M * np.random.default_rng([seed, 1]).standard_normal(cruising().shape)
    beat = read(cruising())
    measured = emulator(TRUTH[None])[0] + read(cruising() + noise) - beat
    model = SimpleNamespace(gait=read, noise=SimpleNamespace(sd_m=np.full(len(ALONG_M), SD_M)))
    near = TRUTH * (1 + 0.02 * np.random.default_rng(seed).standard_normal((400, 5)))
    found = SimpleNamespace(likelihood=SimpleNamespace(emulator=emulator))
    session = SimpleNamespace(trials=(model,), measured=measured)
    return cast(Posterior, SimpleNamespace(model=session, found=found, coefficients=near))


def test_with_white_noise_it_is_least_squares(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(naive, "_STEPS", 600)
    monkeypatch.setattr(naive, "_BURN_IN", 200)
    read = reader()
    emulator = linear_emulator(1 + 14 * len(ALONG_M))
    session = swum(read, emulator, 0)
    found = naive_posterior(session)
    step = 1e-4
    slopes = np.stack([emulator((TRUTH + step * unit)[None])[0] for unit in np.eye(5)])
    slopes = (slopes - emulator(TRUTH[None])[0]) / step  # (5, k)
    precision = np.linalg.inv(naive._white(session.model.trials[0])) / SD_M**2
    information = slopes @ precision @ slopes.T
    middle = TRUTH + np.linalg.solve(
        information, slopes @ precision @ (session.model.measured - emulator(TRUTH[None])[0])
    )
    sd = np.sqrt(np.diag(np.linalg.inv(information)))
    assert (np.abs(found.middle - middle) < 0.2 * sd).all()
    assert found.q95 - found.q05 == pytest.approx(2 * 1.645 * sd, rel=0.15)


@pytest.mark.long
def test_where_noise_lasts_it_is_sure_of_something_else(drawn: DrawnSession, posterior: Posterior) -> None:
    found, truth = naive_posterior(posterior), np.array(drawn.truth)
    off = np.abs(truth - found.middle) / ((found.q95 - found.q05) / 3.29)
    assert off.max() > 3.0  # the intervals need not be narrow: boxes that are off pass for noise
    draws = posterior.coefficients
    assert (np.abs(truth - draws.mean(axis=0)) < 3.0 * draws.std(axis=0)).all()
