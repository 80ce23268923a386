"""The search finds the posterior, and draws from it, where that is known: gaits that are linear in the roots."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from fitting.model.discrepancy import Discrepancy
from fitting.model.session_model import Disturbances
from fitting.posterior.exploration import explore
from fitting.posterior.sampling import R_HAT, Draws, sample
from fitting.posterior.search_state import SearchState

pytestmark = pytest.mark.long

TRUTH, LENGTH, SD = np.array([0.5, 7.0, 2.0, 4.0, 5.5]), 30, 0.02


@dataclass(frozen=True, eq=False)
class LinearSession:
    """Stands for a session whose gaits are a linear map of the roots of the coefficients, without discrepancy."""

    slopes: np.ndarray
    measured: np.ndarray
    noise: np.ndarray

    @classmethod
    def drawn(cls, seed: int) -> LinearSession:
        random = np.random.default_rng(seed)
        slopes, noise = random.standard_normal((LENGTH, 5)), SD**2 * np.eye(LENGTH)
        return cls(slopes, slopes @ np.sqrt(TRUTH) + SD * random.standard_normal(LENGTH), noise)

    @property
    def discrepancy(self) -> Discrepancy:
        return Discrepancy(np.zeros((LENGTH, LENGTH)), np.zeros((LENGTH, 2)))

    @property
    def at_half_steps(self) -> LinearSession:
        return self

    def simulated(self, coefficients: np.ndarray) -> np.ndarray:
        return np.sqrt(coefficients) @ self.slopes.T

    @property
    def trials(self) -> tuple[None]:
        return (None,)

    def disturbances(self, _coefficients: np.ndarray) -> Disturbances:
        return Disturbances(self.noise, *[np.zeros((LENGTH, 0))] * 4)


@pytest.fixture(scope="module")
def session() -> LinearSession:
    return LinearSession.drawn(0)


@pytest.fixture(scope="module")
def progress() -> list[tuple[str, float | None]]:
    """What the sampler said while it drew."""
    return []


@pytest.fixture(scope="module")
def draws(session: LinearSession, progress: list[tuple[str, float | None]]) -> Draws:
    found = explore(session, seed=1)  # type: ignore[arg-type]
    assert found.settled
    assert found.emulator_error < 0.1
    return sample(found, effective=200, seed=1, tell=lambda said, share: progress.append((said, share)))


def test_draws_are_those_of_the_known_posterior_and_enough(session: LinearSession, draws: Draws) -> None:
    roots = np.sqrt(draws.flat[:, :5])
    inverse = np.linalg.inv(session.slopes.T @ session.slopes)
    mean, covariance = inverse @ session.slopes.T @ session.measured, SD**2 * inverse
    sd = np.sqrt(np.diag(covariance))
    assert (np.abs(roots.mean(axis=0) - mean) < 0.15 * sd).all()
    assert roots.std(axis=0) == pytest.approx(sd, rel=0.1)
    assert np.corrcoef(roots.T) == pytest.approx(covariance / np.outer(sd, sd), abs=0.1)
    assert draws.enough
    assert draws.ess_bulk[:5].min() >= 200
    assert draws.r_hat[:5].max() <= R_HAT
    assert 0.1 < draws.acceptance < 0.9
    assert not draws.flags


def test_the_progress_tells_how_the_chains_fare(draws: Draws, progress: list[tuple[str, float | None]]) -> None:
    said, share = progress[-1]
    assert said.startswith(f"sampling: {draws.ess_bulk[:5].min():.0f} effective draws, R-hat ")
    assert said.endswith(f"acceptance {draws.acceptance:.2f}, autocorrelation {draws.autocorrelation:.0f} steps")
    assert share is not None
    assert 0 < share <= 0.99


def test_a_search_that_was_stopped_ends_as_if_it_had_not(session: LinearSession, tmp_path: Path) -> None:
    steps: list[str] = []
    whole = explore(session, seed=1, tell=lambda step, _share: steps.append(step))  # type: ignore[arg-type]
    assert (steps[2], steps[-1]) == ("round 3 of looking for the posterior", "looking closer at the posterior")
    told: list[str] = []

    def stop_twice(step: str, _share: float | None) -> None:
        told.append(step)
        if len(told) in (3, len(steps) + 1):
            raise KeyboardInterrupt

    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            explore(session, None, 1, stop_twice, tmp_path / "search.npz")  # type: ignore[arg-type]
    again = explore(session, None, 1, stop_twice, tmp_path / "search.npz")  # type: ignore[arg-type]
    assert told == [*steps[:3], *steps[2:], steps[-1]]
    assert np.array_equal(again.walkers, whole.walkers)
    assert np.array_equal(again.likelihood.known, whole.likelihood.known)
    assert again.simulations == whole.simulations


def test_a_file_that_was_cut_off_is_no_search(tmp_path: Path) -> None:
    (tmp_path / "search.npz").write_bytes(b"PK cut off")
    assert SearchState.load(tmp_path / "search.npz") is None
    assert SearchState.load(tmp_path / "none.npz") is None
