"""Distances in a space that is small enough to know them."""

import numpy as np
import pytest

from fitting.signatures import Whitened

K = 9


@pytest.fixture
def space() -> Whitened:
    """Unit noise; coefficients move the first five numbers and have no prior to speak of."""
    return Whitened.of(np.eye(K), np.eye(K)[:, :5], np.full(5, 1e9))


def test_what_coefficients_and_noise_can_do_has_little_length(space: Whitened) -> None:
    row = np.arange(1.0, K + 1)
    assert space.length(np.where(np.arange(K) < 5, row, 0.0)) == pytest.approx(0.0, abs=1e-6)
    assert space.length(row) == pytest.approx(np.linalg.norm(row[5:]))
    held = Whitened.of(np.eye(K), np.eye(K)[:, :5], np.ones(5))
    assert held.length(np.eye(K)[0]) == pytest.approx(np.sqrt(0.5))

    along = np.ones(K) / np.sqrt(K)
    noise = np.eye(K) + 8 * np.outer(along, along)
    correlated = Whitened.of(noise, np.zeros((K, 5)), np.ones(5))
    assert correlated.length(6 * along) == pytest.approx(2.0)
