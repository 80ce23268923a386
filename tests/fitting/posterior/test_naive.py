"""White noise gives least squares: right where noise is white, sure of something else where it lasts."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from benchmarks.posterior.truth import DrawnSession
from fitting.posterior import Gait, Posterior, naive
from fitting.posterior.emulator import Emulator, fit_emulator
from fitting.posterior.naive import naive_posterior
from tests.fitting.posterior.waves import ALONG_M, cruising, reader

SD_M = 1e-3
TRUTH = np.array([1.0, 2.0, 3.0, 4.0, 5.0])


def linear_emulator(length: int) -> Emulator:
    """Of gaits that are linear in the roots of the coefficients."""
    random = np.random.default_rng(0)
    points = random.uniform(0.2, 9.8, (200, 5))
    slopes = 0.01 * random.standard_normal((5, length))
    return fit_emulator(points, np.sqrt(points) @ slopes, np.ones(200))


def swum(read: Gait, emulator: Emulator, seed: int) -> Posterior:
    """A trial of white noise about the gait of the truth, and draws to start from."""
    noise = SD_M * np.random.default_rng([seed, 1]).standard_normal(cruising().shape)
    beat = read(cruising())
    measured = emulator(TRUTH[None])[0] + read(cruising() + noise) - beat
    model = SimpleNamespace(gait=read, noise=SimpleNamespace(sd_m=np.full(len(ALONG_M), SD_M)))
    near = TRUTH * (1 + 0.02 * np.random.default_rng(seed).standard_normal((400, 5)))
    found = SimpleNamespace(likelihood=SimpleNamespace(emulator=emulator))
    session = SimpleNamespace(trials=(model,), measured=measured)
    return cast(Posterior, SimpleNamespace(model=session, found=found, coefficients=near))


def test_with_white_noise_it_is_least_squares(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(naive, "_STEPS", 600)
    monkeypatch.setattr(naive, "_BURN_IN", 200)
    read = reader()
    emulator = linear_emulator(1 + 14 * len(ALONG_M))
    session = swum(read, emulator, 0)
    found = naive_posterior(session)
    step = 1e-4
    slopes = np.stack([emulator((TRUTH + step * unit)[None])[0] for unit in np.eye(5)])
    slopes = (slopes - emulator(TRUTH[None])[0]) / step  # (5, k)
    precision = np.linalg.inv(naive._white(session.model.trials[0])) / SD_M**2
    information = slopes @ precision @ slopes.T
    middle = TRUTH + np.linalg.solve(
        information, slopes @ precision @ (session.model.measured - emulator(TRUTH[None])[0])
    )
    sd = np.sqrt(np.diag(np.linalg.inv(information)))
    assert (np.abs(found.middle - middle) < 0.2 * sd).all()
    assert found.q95 - found.q05 == pytest.approx(2 * 1.645 * sd, rel=0.15)


@pytest.mark.long
def test_where_noise_lasts_it_is_sure_of_something_else(drawn: DrawnSession, posterior: Posterior) -> None:
    found, truth = naive_posterior(posterior), np.array(drawn.truth)
    off = np.abs(truth - found.middle) / ((found.q95 - found.q05) / 3.29)
    assert off.max() > 3.0  # the intervals need not be narrow: boxes that are off pass for noise
    draws = posterior.coefficients
    assert (np.abs(truth - draws.mean(axis=0)) < 3.0 * draws.std(axis=0)).all()
