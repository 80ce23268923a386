"""Scores of a posterior that is right, too narrow or shifted, without any session."""

from __future__ import annotations

import numpy as np

from benchmarks.posterior.score import RANKED, PosteriorScore


def score(seed: int, narrow: float = 1.0, shift: float = 0.0, warns: bool = False) -> PosteriorScore:
    """A truth drawn from a unit normal that the posterior believes to be so wide, after a shift."""
    random = np.random.default_rng(seed)
    truth = random.standard_normal(5)
    draws = shift + narrow * random.standard_normal((4000, 5))
    q05, q50, q95 = np.quantile(draws, [0.05, 0.5, 0.95], axis=0)
    ones = (1.0,) * 5
    return PosteriorScore(
        seed=seed,
        frequency_hz=(0.7, 1.2),
        tried=1,
        varied=seed % 2 == 1,
        truth=tuple(truth),
        rank=tuple(int(r) for r in (draws[:RANKED] < truth).sum(axis=0)),
        below=tuple(map(float, (draws < truth).mean(axis=0))),
        q05=tuple(q05),
        q50=tuple(q50),
        q95=tuple(q95),
        mean=tuple(draws.mean(axis=0)),
        sd=tuple(draws.std(axis=0)),
        r_hat=ones,
        ess_bulk=ones,
        fit=tuple(draws.mean(axis=0)),
        sizes=(0.003,) * 10,
        discrepancy=(0.01, 0.01),
        misfit_p=0.001 if warns else 0.5,
        flags=(),
        simulations=640,
        seconds=20.0,
    )
