"""Runs to feed the twin with, and the Sobol points that the issue asks to survive."""

from typing import Any

import numpy as np
from scipy.stats import qmc

from swimcal.mjcf import PUBLISHED_COEFFICIENTS
from swimcal.runs import Runs


def runs(frequency_hz: Any, phase_rad: Any = 0.0, coefficients: Any = PUBLISHED_COEFFICIENTS, **others: Any) -> Runs:
    """Runs of the given frequencies; phases and coefficients are broadcast over them."""
    frequency_hz = np.atleast_1d(np.asarray(frequency_hz, float))
    n = len(frequency_hz)
    return Runs(
        np.broadcast_to(np.asarray(coefficients, float), (n, 5)),
        frequency_hz,
        np.broadcast_to(np.asarray(phase_rad, float), (n,)),
        **others,
    )


def random_runs(n: int, seed: int, **others: Any) -> Runs:
    """Runs that differ in everything."""
    rng = np.random.default_rng(seed)
    return runs(rng.uniform(0.4, 2.0, n), rng.uniform(0, 6.28, n), rng.uniform(0.2, 8, (n, 5)), **others)


def sobol_runs(n: int) -> Runs:
    """n points over five coefficients in [0, 10], 0.3 to 3 Hz (evenly in its logarithm) and any phase."""
    points = qmc.Sobol(7, seed=0).random(n)
    return Runs(10 * points[:, :5], 0.3 * 10 ** points[:, 5], 2 * np.pi * points[:, 6])
