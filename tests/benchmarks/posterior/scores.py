"""Scores of a posterior that is right, too narrow or shifted, without any session."""

from __future__ import annotations

import numpy as np

from benchmarks.posterior.score import PosteriorScore


def score(seed: int, narrow: float = 1.0, shift: float = 0.0, warns: bool = False) -> PosteriorScore:
    """A truth drawn from a unit normal that the posterior believes to be so wide, after a shift."""
    random = np.random.default_rng(seed)
    truth = random.standard_normal(5)
    draws = shift + narrow * random.standard_normal((4000, 5))
    q05, q95 = np.quantile(draws, [0.05, 0.95], axis=0)
    return PosteriorScore(
        seed=seed,
        varied=seed % 2 == 1,
        truth=tuple(truth),
        below=tuple(map(float, (draws < truth).mean(axis=0))),
        q05=tuple(q05),
        q95=tuple(q95),
        mean=tuple(draws.mean(axis=0)),
        sd=tuple(draws.std(axis=0)),
        r_hat=(1.0,) * 5,
        misfit_p=0.001 if warns else 0.5,
        flags=(),
        seconds=20.0,
    )
