"""The damped sine recovers what it was made with, and knows how well."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fitting.free_decay.damped_sine import design, fit_damped_sine, frequency_error

TIME_S = np.arange(90) / 60.0
SHAPE = np.array([[0.01, -0.02, 0.0], [0.05, 0.08, 0.1], [0.01, 0.0, -0.02]])  # rest, cosine, sine of three markers, m


@settings(max_examples=25, deadline=None)
@given(st.floats(1.5, 9.0), st.floats(0.02, 0.45))
def test_frequency_and_damping_are_found_from_anywhere(hz: float, ratio: float) -> None:
    rate = 2 * np.pi * hz * ratio / np.sqrt(1 - ratio**2)
    lateral = design(TIME_S, hz, rate) @ SHAPE

    ring = fit_damped_sine(TIME_S, lateral, np.ones_like(lateral))

    assert ring.frequency_hz == pytest.approx(hz, rel=1e-4)
    assert ring.damping_ratio == pytest.approx(ratio, rel=1e-3)
    assert ring.natural_hz == pytest.approx(hz / np.sqrt(1 - ratio**2), rel=1e-4)
    assert ring.rest_m == pytest.approx(SHAPE[0], abs=1e-5)


def test_the_standard_error_is_that_of_the_scatter() -> None:
    random, found, said = np.random.default_rng(0), [], []
    clean, weight = design(TIME_S, 3.5, 3.0) @ SHAPE, np.ones((90, 3))
    for _ in range(60):
        noisy = clean + 0.0005 * random.standard_normal(clean.shape)
        ring = fit_damped_sine(TIME_S, noisy, weight, (3.4, 2.5))
        found.append(ring.frequency_hz)
        said.append(frequency_error(TIME_S, noisy, weight, ring))

    assert np.mean(said) == pytest.approx(np.std(found), rel=0.3)
