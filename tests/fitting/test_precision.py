"""Intervals of coefficients: as wide as what repeated noise does to a fit, and flagged where they say nothing."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fitting.coefficient_fit import Restart, flags_of
from fitting.mean_distance import MeanDistance
from fitting.precision import covariance, intervals
from tests.fitting.exact_swims import lasting_noise

FRAMES, MARKERS, FPS, NOISE_M = 240, 3, 60.0, 0.5e-3
TRUTH = np.array([0.6, 1.4, 2.4, 2.0, 1.0, 0.5])


class LinearSwims:
    """A stand-in for a `SearchSpace`: two trials whose markers follow five roots and a phase linearly."""

    size = 6
    swims = SimpleNamespace(
        comparison="published",
        trials=[
            SimpleNamespace(
                weight=np.ones((FRAMES, MARKERS)),
                scored=np.ones(FRAMES, bool),
                time_s=np.arange(FRAMES) / FPS,
                markers=("nose", "neck", "tail_1"),
            )
        ]
        * 2,
    )

    def __init__(self, noise: np.ndarray) -> None:
        """Noise (2, n, m, 2) of the trials, each then aligned at the nose of its first frame."""
        time_s = np.arange(FRAMES) / FPS
        waves = np.stack([np.sin((k + 1) * time_s + k) + (0.3 * k) * time_s for k in range(6)], axis=-1)
        turned = np.stack([waves, np.roll(waves, 1, axis=-1)], axis=1)[:, None] * np.array([1, 0.9, 1.4])[:, None, None]
        slopes = 0.01 * np.stack([turned, turned[::-1]])  # (2, n, m, 2, p)
        self._slopes = (slopes - slopes[:, :1, :1]).reshape(-1, 6)
        self._noise = (noise[:, :1, :1] - noise).reshape(-1, 1)
        self.norm = MeanDistance(np.full(len(self._noise) // 2, 2 / len(self._noise)))

    def errors(self, points: np.ndarray) -> np.ndarray:
        return self._slopes @ (points.reshape(6, -1) - TRUTH[:, None]) + self._noise

    def slopes(self, _x: np.ndarray, _errors: np.ndarray) -> np.ndarray:
        return self._slopes

    def best(self) -> np.ndarray:
        point = TRUTH[:, None]
        for _ in range(20):
            gradient, curvature = self.norm.grad_hess(self.errors(point), self._slopes)
            point = point - np.linalg.solve(curvature, gradient)
        return point[:, 0]


@pytest.fixture(scope="module")
def draws() -> list[LinearSwims]:
    random = np.random.default_rng(0)
    shape = (2, FRAMES, MARKERS, 2)
    return [LinearSwims(NOISE_M * lasting_noise(shape, random, lasts_s=0.1)) for _ in range(60)]


def test_standard_errors_and_intervals_are_what_repeated_noise_does(draws: list[LinearSwims]) -> None:
    spaces: list[Any] = draws
    found = np.array([space.best() for space in spaces])
    said = np.mean([np.diag(covariance(space, point)) for space, point in zip(spaces, found, strict=True)], axis=0)

    np.testing.assert_allclose(np.sqrt(said), np.sqrt(((found - TRUTH) ** 2).mean(axis=0)), rtol=0.35)
    ends = np.array([intervals(space, point) for space, point in zip(spaces, found, strict=True)])  # (s, 5, 2)
    assert ((ends[..., 0] <= TRUTH[:5] ** 2) & (TRUTH[:5] ** 2 <= ends[..., 1])).mean() > 0.85


INTERVAL = np.array([[0.35, 0.45], [1.8, 2.2], [5.0, 7.0], [3.8, 4.2], [0.0, 0.3]])


def best(coefficients: tuple[float, ...] = (0.4, 2.0, 6.0, 4.0, 0.1)) -> Restart:
    return Restart(np.ones(5), np.array(coefficients), np.zeros(1), 0.01, np.array([0.01]), True)


def test_an_interval_that_says_nothing_is_flagged_with_its_ends() -> None:
    wide = INTERVAL.copy()
    wide[4] = 0.4, 6.0
    (flag,) = flags_of([best()], wide)

    assert flag.kind == "unidentifiable"
    assert "magnus_lift" in flag.message
    assert "0.4 to 6" in flag.message
    assert flags_of([best()], INTERVAL) == ()
