"""The search finds the posterior, and draws from it, where that is known: gaits that are linear in the roots."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from fitting.posterior import explore, sample
from fitting.posterior.likelihood import Discrepancy
from fitting.posterior.sampling import R_HAT, Draws
from fitting.posterior.session_model import Disturbances

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
        return Disturbances(self.noise, *[np.zeros((LENGTH, 0))] * 3)


@pytest.fixture(scope="module")
def session() -> LinearSession:
    return LinearSession.drawn(0)


@pytest.fixture(scope="module")
def draws(session: LinearSession) -> Draws:
    found = explore(session, seed=1)  # type: ignore[arg-type]
    assert found.settled
    assert found.emulator_error < 0.1
    return sample(found, effective=200, seed=1)


def test_draws_are_those_of_the_known_posterior(session: LinearSession, draws: Draws) -> None:
    roots = np.sqrt(draws.flat[:, :5])
    inverse = np.linalg.inv(session.slopes.T @ session.slopes)
    mean, covariance = inverse @ session.slopes.T @ session.measured, SD**2 * inverse
    sd = np.sqrt(np.diag(covariance))
    assert (np.abs(roots.mean(axis=0) - mean) < 0.15 * sd).all()
    assert roots.std(axis=0) == pytest.approx(sd, rel=0.1)
    assert np.corrcoef(roots.T) == pytest.approx(covariance / np.outer(sd, sd), abs=0.1)


def test_draws_are_as_many_as_wanted_and_agree(draws: Draws) -> None:
    assert draws.enough
    assert draws.ess_bulk[:5].min() >= 200
    assert draws.r_hat[:5].max() <= R_HAT
    assert 0.1 < draws.acceptance < 0.9
    assert not draws.flags
