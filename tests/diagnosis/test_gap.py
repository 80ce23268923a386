"""A shrinkage is what it is said to be, and its interval holds the value without noise."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from diagnosis.gap import shrinkage
from fitting.signatures import Whitened

K = 200
ROOT = np.tril(np.random.default_rng(0).standard_normal((K + 1, K + 1))) / 10 + 2 * np.eye(K + 1)


def held(left: np.ndarray) -> SimpleNamespace:
    """Held-out swims of one trial, whose frequency stands last."""
    space = Whitened(ROOT, np.zeros((K + 1, 5)), np.ones(5))
    return SimpleNamespace(left=left, space=space, model=SimpleNamespace(measured=left[:-1]))


def coloured(white: np.ndarray) -> np.ndarray:
    return ROOT @ np.append(white, 3.0)


def test_half_of_a_gap_gone_is_three_quarters_of_its_squares() -> None:
    gap, noise = 20 * np.eye(K)[0] + 15 * np.eye(K)[7], np.random.default_rng(1).standard_normal(K)
    found = shrinkage(held(coloured(gap + noise)), coloured(gap / 2 + noise))  # type: ignore[arg-type]
    assert found.value == pytest.approx(0.75, abs=0.03)


@pytest.mark.parametrize("off_hz", [0.0, 1000.0])
def test_a_gap_within_noise_has_no_shrinkage_whatever_the_frequency(off_hz: float) -> None:
    left = coloured(np.random.default_rng(2).standard_normal(K))
    left[-1] += off_hz
    found = shrinkage(held(left), left)  # type: ignore[arg-type]
    assert (found.value, found.interval) == (None, None)
    assert shrinkage(held(coloured(30 * np.eye(K)[0])), None).value is None  # type: ignore[arg-type]


@pytest.mark.parametrize(("before", "after"), [(25.0, 10.0), (16.0, 0.0)])
def test_the_interval_holds_the_value_without_noise(before: float, after: float) -> None:
    random, inside = np.random.default_rng(4), 0
    for seed in range(200):
        gap, rest = (size * random.standard_normal(K) / np.sqrt(K) for size in (before, after))
        noise = np.exp(0.09 * random.standard_normal() / 2) * random.standard_normal(K)
        found = shrinkage(held(coloured(gap + noise)), coloured(rest + noise), seed)  # type: ignore[arg-type]
        assert found.interval is not None
        inside += found.interval[0] <= 1 - (rest @ rest) / (gap @ gap) <= found.interval[1]
    assert 0.90 <= inside / 200 <= 0.99


@pytest.mark.long
def test_the_interval_holds_the_truth_where_strengths_were_fitted() -> None:
    """Of a linear twin: its strengths are off as far as their covariance says, and a held-out gap tells."""
    random, inside, narrow = np.random.default_rng(5), 0, 0
    slopes, spread = random.standard_normal((K, 3)), 0.35
    for seed in range(200):
        gap, rest = (size * random.standard_normal(K) / np.sqrt(K) for size in (25.0, 3.0))
        seen = gap + random.standard_normal(K)
        off = spread * random.standard_normal(3)
        left = rest + (seen - gap) - slopes @ off
        draws = left - (spread * random.standard_normal((32, 3))) @ slopes.T
        otherwise = (np.array([coloured(seen)] * 32), np.array([coloured(row) for row in draws]))
        told = held(coloured(seen))
        truth = 1 - (rest @ rest) / (gap @ gap)
        with_both = shrinkage(told, coloured(left), seed, otherwise)  # type: ignore[arg-type]
        with_noise = shrinkage(told, coloured(left), seed)  # type: ignore[arg-type]
        assert with_both.interval is not None
        assert with_noise.interval is not None
        inside += with_both.interval[0] <= truth <= with_both.interval[1]
        narrow += with_noise.interval[0] <= truth <= with_noise.interval[1]
    assert 0.90 <= inside / 200 <= 1.0
    assert narrow / 200 < 0.85


def test_how_surely_is_not_known_where_twins_a_little_off_diverge() -> None:
    left, nowhere = coloured(6 * np.random.default_rng(5).standard_normal(K)), np.full((5, K + 1), np.nan)
    told = shrinkage(held(left), 0.5 * left, otherwise=(nowhere, nowhere))
    assert told.value is not None
    assert told.interval is None
