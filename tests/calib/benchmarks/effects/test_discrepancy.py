"""What the twin leaves of a base state is found from sessions in which it is known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import block_diag

from calib.benchmarks.effects.discrepancy import LENGTH, BaseSession, discrepancy_of, robust_covariance

TRIALS, SESSIONS = 3, 60
SCALE = np.geomspace(1e-3, 1e-5, LENGTH)
PARAMETERS = [("segment_coefficients", 0), ("segment_coefficients", 1), ("fluid_memory", 0), ("wall_proximity", 0)]
STRENGTHS = {PARAMETERS[0]: 0.15, PARAMETERS[2]: 0.1}


def session(seed: int, size: float = 1.0, strong: float = 1.0) -> BaseSession:
    random = np.random.default_rng(seed)
    own = random.multivariate_normal(np.zeros(LENGTH), covariance(), TRIALS)
    columns = {key: (6 * np.tile(SCALE, TRIALS) * random.standard_normal(TRIALS * LENGTH)) for key in PARAMETERS}
    alike: np.ndarray = sum(strength * random.standard_normal() * columns[key] for key, strength in STRENGTHS.items())
    noise = block_diag(*[np.diag((0.3 * SCALE) ** 2)] * TRIALS)
    left = size * own + strong * np.reshape(alike, own.shape)
    return BaseSession(seed, left, np.zeros((own.size, 5)), noise, columns)


def covariance() -> np.ndarray:
    near = np.exp(-(((np.arange(LENGTH)[:, None] - np.arange(LENGTH)) / 3.0) ** 2))
    return np.asarray(np.outer(SCALE, SCALE) * (0.7 * near + 0.3 * np.eye(LENGTH)))


def apart(found: np.ndarray) -> float:
    """Mean of the square of a whitened gait, which is 1 where a covariance is the true one."""
    root = np.linalg.cholesky(covariance())
    return float(np.trace(np.linalg.solve(root, np.linalg.solve(root, found).T)) / LENGTH)


def test_strengths_that_all_trials_share_are_found_and_no_others() -> None:
    found = discrepancy_of([session(seed) for seed in range(SESSIONS)])
    assert set(found.strengths) == {"segment_coefficients", "fluid_memory"}
    first, second = found.strengths["segment_coefficients"]
    assert first == pytest.approx(0.15, rel=0.35)
    assert second == 0.0
    assert found.strengths["fluid_memory"][0] == pytest.approx(0.1, rel=0.35)


def test_a_few_sessions_that_are_far_off_do_not_say_how_most_are() -> None:
    sizes = [8.0 if seed % 10 == 0 else 1.0 for seed in range(SESSIONS)]
    left = [session(seed, size, 0.0).left for seed, size in enumerate(sizes)]
    plain = np.vstack(left).T @ np.vstack(left) / (TRIALS * SESSIONS)
    assert apart(plain) > 4
    assert apart(robust_covariance(left)) < 0.5 * apart(plain)
