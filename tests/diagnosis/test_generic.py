"""A gap of no particular cause has the size of what is left, and frequencies one of their own."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.generic import GenericGap, generic_covariance

ALONG_M = np.array([0.0, 0.142, 0.3, 0.45, 0.55])
TRIALS, NOISE_SD = 2, 1e-4
GENERIC = generic_covariance(ALONG_M, TRIALS, TRIALS)
KNOWN = NOISE_SD**2 * np.eye(len(GENERIC))


def left(size_m: float, seed: int = 0) -> np.ndarray:
    """(k,) a gap of such a size, its frequencies included, and noise."""
    random = np.random.default_rng([seed, 3])
    gap = size_m * np.linalg.cholesky(GENERIC) @ random.standard_normal(len(GENERIC))
    return np.asarray(gap + NOISE_SD * random.standard_normal(len(gap)))


@pytest.mark.parametrize("size_m", [0.001, 0.01])
def test_its_size_is_found(size_m: float) -> None:
    gap = GenericGap(KNOWN, GENERIC, TRIALS).covariance(left(size_m))
    sizes = np.sqrt(np.diag(gap)[:-TRIALS] / np.diag(GENERIC)[:-TRIALS])
    assert sizes == pytest.approx(size_m, rel=0.3)
