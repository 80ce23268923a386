"""Noise that lasts is told from a swim, and its share in a gait is what repeated draws show."""

from __future__ import annotations

import numpy as np
import pytest

from fitting.posterior.gait import SPEED
from fitting.posterior.noise import GaitNoise, noise_of
from synthetic import TrackingNoise
from synthetic.noise import lasting_errors
from tests.fitting.posterior.waves import ALONG_M, FPS, TIME_S, cruising, reader


def _noisy(lasts_s: float, seed: int) -> np.ndarray:
    """(n, m, 2) with noise of 0.5 mm that lasts and of 0.2 mm that does not."""
    random = np.random.default_rng(seed)
    noise = TrackingNoise(sd_px=0.5, correlation_s=lasts_s)
    lasting = lasting_errors((len(TIME_S), len(ALONG_M), 2), 1 / FPS, noise, random)
    return cruising() + 1e-3 * (lasting + 0.2 * random.standard_normal(lasting.shape))


@pytest.mark.parametrize("lasts_s", [0.04, 0.1, 0.2])
@pytest.mark.parametrize("gaps", [False, True])
def test_noise_is_found_beside_the_swim(lasts_s: float, gaps: bool) -> None:
    usable = np.ones((len(TIME_S), len(ALONG_M)), bool)
    if gaps:
        usable[20:50, 2], usable[90:140, 5], usable[200:, 4], usable[::9, 0] = False, False, False, False
    found = [noise_of(reader(usable), np.where(usable[..., None], _noisy(lasts_s, s), np.nan)) for s in range(3)]
    assert np.mean([noise.sd_m for noise in found]) == pytest.approx(1e-3 * np.hypot(0.5, 0.2), rel=0.1)
    lasting = np.exp(np.mean([np.log(noise.lasts_s) for noise in found]))
    assert lasts_s / 1.4 < lasting < 1.4 * lasts_s


def test_noise_that_lasts_longer_leaves_fewer_independent_frames() -> None:
    frames = [noise_of(reader(), _noisy(lasts_s, 0)).effective for lasts_s in (0.03, 0.1, 0.3)]
    assert len(TIME_S) > frames[0] > 1.5 * frames[1] > 3 * frames[2]


def test_the_covariance_of_a_gait_is_that_of_repeated_draws() -> None:
    usable = np.ones((len(TIME_S), len(ALONG_M)), bool)
    usable[40:80, 3] = False
    read, sd_m = reader(usable), 1e-3 * np.linspace(0.3, 0.9, len(ALONG_M))
    lag_s = np.abs(TIME_S[:, None] - TIME_S)
    correlation = 0.8 * np.exp(-lag_s / 0.1) + 0.2 * np.eye(len(lag_s))
    told = GaitNoise(sd_m, 0.1, 0.2, correlation).covariance(read)
    root = np.linalg.cholesky(correlation)
    drawn = np.einsum("kn,snmc->skmc", root, np.random.default_rng(0).standard_normal((1500, *cruising().shape)))
    gaits = read(cruising() + sd_m[:, None] * drawn)
    seen = np.cov(gaits.T)
    # the heading is found from noisy markers too, left out here: that turns means, but boxes do more
    places = np.arange(1, len(told)).reshape(-1, 2, 7)
    beats = np.append(places[:, :, 1:].ravel(), SPEED)
    assert np.diag(seen)[beats] == pytest.approx(np.diag(told)[beats], rel=0.2)
    white = np.linalg.cholesky(np.linalg.inv(told[np.ix_(beats, beats)]))
    assert np.trace(white.T @ seen[np.ix_(beats, beats)] @ white) / len(beats) == pytest.approx(1.0, abs=0.05)
