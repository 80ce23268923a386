"""The emulator meets polynomials and knows what it misses; the likelihood is a normal however it is computed."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from benchmarks.posterior.truth import DrawnSession
from fitting.covariance import MEDIANS, wave_discrepancy
from fitting.mode import Mode, mode_at
from fitting.posterior.emulator import SPEEDS, WAVE, Likelihood, exponents, fit_emulator, size_of, terms
from fitting.session_model import SessionModel
from fitting.trial import HARMONICS
from tests.fitting.posterior.waves import ALONG_M, cruising, reader


def _points(count: int, seed: int, low: float = 1.0, high: float = 4.0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(low, high, (count, 5))


def _smooth(points: np.ndarray, outputs: int = 4, degree: int = 2) -> np.ndarray:
    powers = exponents(degree)
    return terms(points, powers) @ np.random.default_rng(5).standard_normal((len(powers), outputs))


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_polynomials_in_the_roots_are_met_exactly(degree: int) -> None:
    points, fresh = _points(400, 0), _points(50, 1)
    emulator = fit_emulator(points, _smooth(points, degree=degree))
    assert emulator.powers.sum(axis=1).max() >= degree
    assert emulator(fresh) == pytest.approx(_smooth(fresh, degree=degree), abs=1e-3)
    assert np.sqrt(np.diag(emulator.error)).max() < 1e-3


def test_what_it_says_it_misses_is_what_it_misses() -> None:
    random, points, fresh = np.random.default_rng(2), _points(150, 3), _points(2000, 4)
    size = np.array([0.02, 0.1, 0.3, 1.0])
    together = random.standard_normal((len(points), 1))
    rough = size * (0.6 * random.standard_normal((len(points), 4)) + 0.8 * together)
    emulator = fit_emulator(points, _smooth(points) + rough)
    missed = _smooth(fresh) - emulator(fresh)
    fresh_rough = size * (0.6 * random.standard_normal((len(fresh), 4)) + 0.8 * random.standard_normal((len(fresh), 1)))
    actual = np.cov((missed + fresh_rough).T)
    assert np.diag(emulator.error) / np.diag(actual) == pytest.approx(1.0, abs=0.35)
    assert np.sign(actual[0, 3]) * emulator.error[0, 3] > 0
    common = [each[0, 3] / np.sqrt(each[0, 0] * each[3, 3]) for each in (emulator.error, actual)]
    assert common[0] == pytest.approx(common[1], abs=0.15)


LENGTH, TRIALS = 24, 2


@pytest.fixture(scope="module")
def likelihood() -> Likelihood:
    """Of a row of two trials, with an emulator of numbers without a meaning."""
    random = np.random.default_rng(0)
    known, half = random.standard_normal((2, LENGTH, LENGTH))
    speed = np.zeros((LENGTH, TRIALS))
    speed[0, 0], speed[LENGTH // 2, 1] = 2.0, 3.0
    points = random.uniform(2.0, 4.0, (120, 5))
    features = points @ random.standard_normal((5, LENGTH))
    measured = features.mean(axis=0) + random.standard_normal(LENGTH)
    wave = half[:, :5] @ half[:, :5].T  # its rank is low, as where means do not count
    return Likelihood(
        measured,
        known @ known.T + 0.1 * np.eye(LENGTH),
        wave,
        speed,
        fit_emulator(points, features),
        np.zeros(2),
        np.ones(2),
    )


@pytest.mark.parametrize("wave", [1e-3, 0.05, 1.0])
@pytest.mark.parametrize("speed", [1e-3, 0.05, 1.0])
def test_it_is_a_dense_normal_with_both_discrepancies(likelihood: Likelihood, wave: float, speed: float) -> None:
    features = likelihood.measured + np.random.default_rng(1).standard_normal((6, LENGTH))
    sizes = np.tile([wave, speed], (6, 1))
    covariance = likelihood.known + wave**2 * likelihood.wave + speed**2 * likelihood.speed @ likelihood.speed.T
    dense = multivariate_normal(likelihood.measured, covariance).logpdf(features)
    ours = likelihood.of_features(features, sizes) - 0.5 * LENGTH * np.log(2 * np.pi)
    assert ours == pytest.approx(dense, rel=1e-7)


def test_by_the_emulator_it_is_that_of_emulated_features(likelihood: Likelihood) -> None:
    random = np.random.default_rng(2)
    points, sizes = random.uniform(2.5, 3.5, (8, 5)), random.uniform(0.01, 0.5, (8, 2))
    expected = likelihood.of_features(likelihood.emulator(points), sizes)
    assert likelihood(points, sizes) == pytest.approx(expected, rel=1e-9)


def test_it_says_nothing_of_what_was_never_simulated(likelihood: Likelihood) -> None:
    assert likelihood(np.full((1, 5), 9.5), np.full((1, 2), 0.1)) == -np.inf


def test_a_wave_that_is_off_is_off_by_its_size_and_alike_nearby() -> None:
    features = reader()(cruising())
    total = wave_discrepancy(features, ALONG_M)
    first = np.arange(1, len(features)).reshape(-1, 2, 1 + 2 * HARMONICS)[:, 1, 1]  # cosine across
    sd = np.sqrt(np.diag(total)[first])
    assert sd[-1] == pytest.approx(0.05 / np.sqrt(2), rel=1e-6)
    likeness = total[np.ix_(first, first)] / np.outer(sd, sd)
    assert likeness[-1, -2] > 0.6 > likeness[-1, 2] > 0
    assert (np.diag(total)[np.arange(1, len(features)).reshape(-1, 2, 7)[..., 0]] == 0).all()
    assert np.linalg.eigvalsh(total).min() > -1e-12


@pytest.mark.long
def test_at_the_sizes_of_a_mode_it_has_the_covariance_of_the_mode(drawn: DrawnSession) -> None:
    model = SessionModel.of(drawn.twin, drawn.trials, with_course=True)
    mode = mode_at(model, np.array(drawn.truth), MEDIANS)
    found = Likelihood.of(mode, fit_emulator(np.tile(mode.coefficients, (3, 1)), np.zeros((3, len(mode.residual)))))
    wave, speed = (size_of(mode, names) ** 2 for names in (WAVE, SPEEDS))
    total = found.known + wave * found.wave + speed * found.speed @ found.speed.T
    assert total == pytest.approx(mode.total, abs=1e-12)


@pytest.mark.long
def test_the_size_of_a_discrepancy_has_the_priors_of_its_components(mode: Mode) -> None:
    """The more its components are beyond their medians at the mode, the less it is so in the prior's mean."""
    found = Likelihood.of(mode, fit_emulator(np.tile(mode.coefficients, (3, 1)), np.zeros((3, len(mode.residual)))))
    assert found.ln_sd == pytest.approx([1.5 / np.sqrt(2), 0.2 / np.sqrt(2)])
    assert np.exp(found.ln_mean[1]) == pytest.approx(np.hypot(0.03, 0.02), rel=0.05)
