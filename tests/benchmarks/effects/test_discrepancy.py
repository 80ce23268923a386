"""What the twin leaves of a base state is found from sessions in which it is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import block_diag

from benchmarks.effects import discrepancy
from benchmarks.effects.discrepancy import (
    LENGTH,
    BaseSession,
    base_sessions,
    discrepancy_of,
    in_common,
    measure,
    robust_covariance,
)
from diagnosis.discrepancy import Discrepancy, nearness
from fitting.features import advance_phase, marker_part

TRIALS, SESSIONS = 3, 60
HERTZ = np.array([0.6, 0.7, 1.3])
SCALE = np.geomspace(1e-3, 1e-5, LENGTH)
PARAMETERS = [("segment_coefficients", 0), ("segment_coefficients", 1), ("fluid_memory", 0), ("wall_proximity", 0)]
STRENGTHS = {PARAMETERS[0]: 0.15, PARAMETERS[2]: 0.1}


def session(
    seed: int, size: float = 1.0, strong: float = 1.0, everywhere: float = 0.0, near: float = 0.0
) -> BaseSession:
    """Of swims that begin at any phase, and have shares of the residual in common."""
    random = np.random.default_rng(seed)
    phase = random.uniform(-np.pi, np.pi, TRIALS)
    between = everywhere + near * nearness(HERTZ) + (1 - everywhere - near) * np.eye(TRIALS)
    roots = np.linalg.cholesky(covariance()), np.linalg.cholesky(between)
    own = advance_phase(roots[1] @ random.standard_normal((TRIALS, LENGTH)) @ roots[0].T, phase)
    columns = {key: (6 * np.tile(SCALE, TRIALS) * random.standard_normal(TRIALS * LENGTH)) for key in PARAMETERS}
    alike: np.ndarray = sum(strength * random.standard_normal() * columns[key] for key, strength in STRENGTHS.items())
    noise = block_diag(*[np.diag((0.3 * SCALE) ** 2)] * TRIALS)
    left = size * own + strong * np.reshape(alike, own.shape)
    return BaseSession(seed, HERTZ, beating(phase), left, np.zeros((own.size, 5)), noise, columns)


def beating(phase: np.ndarray) -> np.ndarray:
    """Features whose markers are farthest left at a phase."""
    features = np.zeros(LENGTH)
    marker_part(features)[:, 1, 1] = 0.02
    return advance_phase(np.tile(features, (len(phase), 1)), phase)


def covariance() -> np.ndarray:
    close = np.exp(-(((np.arange(LENGTH)[:, None] - np.arange(LENGTH)) / 3.0) ** 2))
    return np.asarray(np.outer(SCALE, SCALE) * (0.7 * close + 0.3 * np.eye(LENGTH)))


def apart(found: np.ndarray) -> float:
    """Mean of the square of a whitened features, which is 1 where a covariance is the true one."""
    root = np.linalg.cholesky(covariance())
    return float(np.trace(np.linalg.solve(root, np.linalg.solve(root, found).T)) / LENGTH)


@pytest.mark.long
def test_strengths_that_all_trials_share_are_found_and_hardly_any_others() -> None:
    found = discrepancy_of([session(seed) for seed in range(SESSIONS)]).strengths
    first, second = found["segment_coefficients"]  # the covariance has part of them already
    assert 0.4 * 0.15 < first < 1.2 * 0.15
    assert 0.4 * 0.1 < found["fluid_memory"][0] < 1.2 * 0.1
    assert max(second, *found.get("wall_proximity", (0.0,))) < 0.04


@pytest.mark.parametrize(("everywhere", "near"), [(0.0, 0.0), (0.6, 0.0), (0.0, 0.7), (0.3, 0.4)])
def test_what_swims_have_in_common_is_found_whatever_the_phases_they_begin_at(everywhere: float, near: float) -> None:
    sessions = [session(seed, 1.0, 0.0, everywhere, near) for seed in range(2 * SESSIONS)]
    found = in_common(sessions, robust_covariance([each.in_phase for each in sessions]))
    largest = np.argsort((found.directions / SCALE[:, None]).std(axis=0))[-12:]
    assert found.common[largest].mean(axis=0) == pytest.approx([everywhere, near], abs=0.12)
    assert found.common[largest].sum(axis=1).max() < everywhere + near + 0.3
    assert found.common.min() >= 0
    assert found.common.sum(axis=1).max() <= 1
    assert np.angle(found.beat.sum()) == pytest.approx(0.0, abs=1e-6)


def test_a_few_sessions_that_are_far_off_do_not_say_how_most_are() -> None:
    sizes = [8.0 if seed % 10 == 0 else 1.0 for seed in range(SESSIONS)]
    left = [session(seed, size, 0.0).in_phase for seed, size in enumerate(sizes)]
    plain = np.vstack(left).T @ np.vstack(left) / (TRIALS * SESSIONS)
    assert apart(plain) > 4
    assert apart(robust_covariance(left)) < 0.5 * apart(plain)


@pytest.mark.long
def test_what_is_measured_is_written_with_its_seeds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def drawn(seeds: Sequence[int], with_effects: bool) -> list[BaseSession]:
        found = [session(seed) for seed in seeds]
        return found if with_effects else [replace(each, columns={}) for each in found]

    monkeypatch.setattr(discrepancy, "base_sessions", drawn)
    monkeypatch.setattr(discrepancy, "SEEDS", range(50))
    measure(tmp_path / "made" / "discrepancy.npz", workers=1)
    found = Discrepancy.load(tmp_path / "made" / "discrepancy.npz")
    reported = discrepancy_of([*drawn(range(25), True), *drawn(range(25, 50), False)])
    assert found.directions == pytest.approx(reported.directions, rel=1e-6)
    assert found.common == pytest.approx(reported.common, abs=1e-6)
    assert found.strengths.keys() == reported.strengths.keys()
    assert all(own == pytest.approx(reported.strengths[name]) for name, own in found.strengths.items())
    assert np.load(tmp_path / "made" / "discrepancy.npz")["seeds"].tolist() == list(range(50))


@pytest.mark.long
def test_a_twin_leaves_little_of_a_base_session_and_it_is_told_what_effects_would_do() -> None:
    (found,) = base_sessions([9005], with_effects=True)
    assert found.residual.shape[1] == LENGTH
    assert 1e-6 < np.sqrt((found.residual[:, 1:] ** 2).mean()) < 5e-4
    names = {name for name, _ in found.columns}
    assert {"segment_coefficients", "tendon_compliance", "fluid_memory"} <= names
    assert not {"marker_offset", "scale_error"} & names
    assert all(column.shape == (found.residual.size,) for column in found.columns.values())
