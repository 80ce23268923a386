"""Simple rules in frequency: a slope needs frequencies that differ."""

import numpy as np
import pytest

from fitting.baselines import speed_constant_stride, speed_line, speed_power_law

ASKED_HZ = (0.6, 0.8, 1.4)


@pytest.mark.parametrize("rule", [speed_line, speed_power_law])
@pytest.mark.parametrize("apart_hz", [0.0, 0.0002, 0.01])
def test_of_one_frequency_filmed_twice_the_stride_is_constant(rule, apart_hz: float) -> None:
    fitted_hz, speeds = (1.0, 1.0 + apart_hz), (0.161, 0.164)
    assert rule(fitted_hz, speeds, ASKED_HZ) == speed_constant_stride(fitted_hz, speeds, ASKED_HZ)


def test_two_frequencies_make_a_line_and_a_power() -> None:
    np.testing.assert_allclose(speed_line((0.5, 1.0), (0.05, 0.15), ASKED_HZ), (0.07, 0.11, 0.23))
    np.testing.assert_allclose(speed_power_law((0.5, 1.0), (0.05, 0.2), ASKED_HZ), 0.2 * np.square(ASKED_HZ))
