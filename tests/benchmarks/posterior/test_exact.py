"""Exact intervals are those of a normal posterior where the twin is linear, and narrow with the noise."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import block_diag

from benchmarks.posterior.exact import _true_noise, exact_widths
from benchmarks.posterior.truth import NOISE
from fitting.posterior import SessionModel
from fitting.posterior.emulator import fit_emulator
from swimmer import Twin
from synthetic import TrackingNoise
from tests.fitting.exact_swims import ROBOT, exact_swims

TRUTH = np.full(5, 5.0)
QUIET = TrackingNoise(sd_px=0.2, half_pixel_grid=False)
LENGTH_SD = 0.2  # of each coefficient, by the noise of the tracks


@pytest.fixture(scope="module")
def model() -> SessionModel:
    swims = exact_swims(hz=(0.7, 1.1), seconds=3.0, noise_m=3e-4)
    return SessionModel.of(Twin(ROBOT, swims[0].markers, workers=1), list(swims), doubts=())


def known(model: SessionModel, noise: TrackingNoise) -> np.ndarray:
    return block_diag(*[_true_noise(trial, noise) for trial in model.trials])


@pytest.fixture(scope="module")
def linear(model: SessionModel) -> Any:
    """A posterior whose twin is linear, of slopes in directions of the noise, with nothing but noise in doubt."""
    random = np.random.default_rng(0)
    count = len(model.measured)
    root = np.linalg.cholesky(known(model, NOISE))
    slopes = root @ np.linalg.qr(random.standard_normal((count, 5)))[0] / LENGTH_SD
    points = random.uniform(0.0, 10.0, (64, 5))
    emulator = fit_emulator(points, model.measured + (points - TRUTH) @ slopes.T, np.ones(64))
    nothing = SimpleNamespace(of=lambda _off: model.noise)
    found = SimpleNamespace(disturbances=nothing, likelihood=SimpleNamespace(emulator=emulator))
    near = TRUTH + LENGTH_SD * random.standard_normal((500, 5))
    return SimpleNamespace(model=model, found=found, coefficients=near, slopes=slopes)


@pytest.mark.long
def test_of_a_linear_twin_they_are_those_of_a_normal_distribution(linear: Any) -> None:
    assert exact_widths(linear, NOISE) == pytest.approx(2 * 1.645 * LENGTH_SD, rel=0.12)


def test_draws_that_stand_in_one_place_do_not_break_it(linear: Any) -> None:
    """A chain that rests repeats its draws; a snooker move from one to its double is undefined."""
    rested = SimpleNamespace(**{**vars(linear), "coefficients": np.repeat(linear.coefficients[:70], 40, axis=0)})
    assert exact_widths(rested, NOISE) == pytest.approx(2 * 1.645 * LENGTH_SD, rel=0.15)


@pytest.mark.long
def test_they_narrow_with_the_noise(linear: Any, model: SessionModel) -> None:
    narrow = np.linalg.inv(linear.slopes.T @ np.linalg.solve(known(model, QUIET), linear.slopes))
    found = exact_widths(linear, QUIET)
    assert found == pytest.approx(2 * 1.645 * np.sqrt(np.diag(narrow)), rel=0.15)
    assert (found < 0.9 * exact_widths(linear, NOISE)).all()
