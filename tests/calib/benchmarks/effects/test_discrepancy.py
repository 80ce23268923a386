"""What the twin leaves of a base state is found from sessions in which it is known."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import block_diag

from calib.benchmarks.effects import discrepancy
from calib.benchmarks.effects.discrepancy import (
    LENGTH,
    BaseSession,
    base_sessions,
    discrepancy_of,
    measure,
    robust_covariance,
)
from diagnosis import Discrepancy

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


@pytest.mark.long
def test_what_is_measured_is_written_with_its_seeds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def drawn(seeds: Sequence[int], with_effects: bool) -> list[BaseSession]:
        found = [session(seed) for seed in seeds]
        return found if with_effects else [BaseSession(s.seed, s.left, s.slopes, s.noise, {}) for s in found]

    monkeypatch.setattr(discrepancy, "base_sessions", drawn)
    monkeypatch.setattr(discrepancy, "SEEDS", range(50))
    measure(tmp_path / "made" / "discrepancy.npz", workers=1)
    found = Discrepancy.load(tmp_path / "made" / "discrepancy.npz")
    told = discrepancy_of([*drawn(range(25), True), *drawn(range(25, 50), False)])
    assert found.covariance == pytest.approx(told.covariance, rel=1e-6)
    assert found.strengths.keys() == told.strengths.keys()
    assert all(own == pytest.approx(told.strengths[name]) for name, own in found.strengths.items())
    assert np.load(tmp_path / "made" / "discrepancy.npz")["seeds"].tolist() == list(range(50))


@pytest.mark.long
def test_a_twin_leaves_little_of_a_base_session_and_it_is_told_what_effects_would_do() -> None:
    (found,) = base_sessions([9005], with_effects=True)
    assert found.left.shape[1] == LENGTH
    assert 1e-6 < np.sqrt((found.left[:, 1:] ** 2).mean()) < 5e-4
    names = {name for name, _ in found.columns}
    assert {"segment_coefficients", "tendon_compliance", "fluid_memory"} <= names
    assert not {"marker_offset", "scale_error"} & names
    assert all(column.shape == (found.left.size,) for column in found.columns.values())
