"""The stand-in for the twin is exact where it can be, and says how far off it is where it cannot."""

from __future__ import annotations

import numpy as np
import pytest

from fitting.posterior.emulator import exponents, fit_emulator, terms


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
