"""A shrinkage is what it is said to be, and its interval holds the value without noise."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.held_out import skill_score

K = 200
ONE = np.zeros(K, int)  # the trial of each number


def test_half_of_a_gap_gone_is_three_quarters_of_its_squares() -> None:
    gap, noise = 20 * np.eye(K)[0] + 15 * np.eye(K)[7], np.random.default_rng(1).standard_normal(K)
    assert skill_score(gap + noise, gap / 2 + noise, ONE).value == pytest.approx(0.75, abs=0.03)


def test_a_gap_within_noise_has_no_shrinkage() -> None:
    noise = np.random.default_rng(2).standard_normal(K)
    found = skill_score(noise, noise, ONE)
    assert (found.value, found.interval) == (None, None)
    assert skill_score(30 * np.eye(K)[0], None, ONE).value is None


def test_trials_that_fare_otherwise_widen_the_interval() -> None:
    random = np.random.default_rng(3)
    gap, noise, two = 30 * random.standard_normal(K) / np.sqrt(K), random.standard_normal(K), np.arange(K) // (K // 2)
    common = skill_score(gap + noise, 0.5 * gap + noise, two).interval
    apart = skill_score(gap + noise, np.where(two, 0.1, 0.7) * gap + noise, two).interval
    assert common is not None
    assert apart is not None
    assert np.ptp(apart) > 1.5 * np.ptp(common)


@pytest.mark.parametrize(("before", "after"), [(25.0, 10.0), (16.0, 0.0)])
def test_the_interval_holds_the_value_without_noise(before: float, after: float) -> None:
    random, inside = np.random.default_rng(4), 0
    for seed in range(200):
        gap, rest = (size * random.standard_normal(K) / np.sqrt(K) for size in (before, after))
        noise = np.exp(0.09 * random.standard_normal() / 2) * random.standard_normal(K)
        found = skill_score(gap + noise, rest + noise, ONE, seed)
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
        otherwise = (np.array([seen] * 32), draws)
        truth = 1 - (rest @ rest) / (gap @ gap)
        with_both = skill_score(seen, left, ONE, seed, otherwise)
        with_noise = skill_score(seen, left, ONE, seed)
        assert with_both.interval is not None
        assert with_noise.interval is not None
        inside += with_both.interval[0] <= truth <= with_both.interval[1]
        narrow += with_noise.interval[0] <= truth <= with_noise.interval[1]
    assert 0.90 <= inside / 200 <= 1.0
    assert narrow / 200 < 0.85


def test_how_surely_is_not_known_where_twins_a_little_off_diverge() -> None:
    left, nowhere = 6 * np.random.default_rng(5).standard_normal(K), np.full((5, K), np.nan)
    told = skill_score(left, 0.5 * left, ONE, otherwise=(nowhere, nowhere))
    assert told.value is not None
    assert told.interval is None
