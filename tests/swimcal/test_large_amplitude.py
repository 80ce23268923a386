"""Large-amplitude elongated body theory against travelling waves in closed form, and against its steady limit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import ellipe, ellipk

from swimcal.ebt import TailMotion, TipMotion, steady_speed_large
from tests.swimcal.robots import FISH
from tests.swimcal.thrust import mean_thrust, mean_thrust_large

MASS = 7.0  # kg/m
amplitudes, wave_numbers, angulars = st.floats(0.005, 0.15), st.floats(0.5, 20.0), st.floats(1.0, 12.0)
speeds = st.floats(0.0, 1.0)


def wave(amplitude_m: float, wave_number: float, angular: float) -> TipMotion:
    """The tip of h = A cos(k x - w t), x backward, at a fixed x over one beat: it moves sideways only."""
    phase = 2 * np.pi * np.arange(2000) / 2000
    return TipMotion(
        forward_speed=np.zeros(2000),
        lateral_speed=amplitude_m * angular * np.sin(phase),
        angle_rad=np.arctan(amplitude_m * wave_number * np.sin(phase)),
    )


def mean_squares(motion: TipMotion) -> TailMotion:
    return TailMotion(np.mean(motion.lateral_speed**2), np.mean(np.tan(motion.angle_rad) ** 2))


def thrust_of_wave(amplitude: float, wave_number: float, angular: float, speed: float) -> float:
    """Lighthill 1971, eq. 8, in closed form.

    With s the sine of the beat, a = A k and c = 1 / sqrt(1 + a^2 s^2): w = A (angular - U k) s c, hence
    T / m = A^2 angular v <s^2 c> - 1/2 A^2 v^2 <s^2 c^3>, v = angular - U k; the means are complete elliptic integrals
    of parameter -a^2: <s^2 c> = 2 (E - K) / (pi a^2), <s^2 c^3> = 2 (K - E / (1 + a^2)) / (pi a^2).
    """
    steep_sq, slip = (amplitude * wave_number) ** 2, angular - speed * wave_number
    e, k = ellipe(-steep_sq), ellipk(-steep_sq)
    means = 2 / (np.pi * steep_sq) * np.array([e - k, k - e / (1 + steep_sq)])
    return float(MASS * amplitude**2 * (angular * slip * means[0] - 0.5 * slip**2 * means[1]))


@given(amplitude=amplitudes, wave_number=wave_numbers, angular=angulars, speed=speeds)
def test_thrust_of_a_travelling_wave_is_the_closed_form(
    amplitude: float, wave_number: float, angular: float, speed: float
) -> None:
    scale = MASS * amplitude**2 * (angular**2 + (speed * wave_number) ** 2)
    expected = thrust_of_wave(amplitude, wave_number, angular, speed)
    rounding = 1e-9 + 1e-14 / (amplitude * wave_number) ** 2  # of the difference of two integrals

    assert mean_thrust_large(wave(amplitude, wave_number, angular), speed, MASS) == pytest.approx(
        expected, abs=rounding * scale
    )


@given(wave_number=wave_numbers, angular=angulars, speed=speeds)
def test_a_small_wave_has_the_thrust_of_the_steady_form(wave_number: float, angular: float, speed: float) -> None:
    amplitude = 1e-3 / wave_number
    motion = wave(amplitude, wave_number, angular)
    scale = MASS * amplitude**2 * (angular**2 + (speed * wave_number) ** 2)

    steady = mean_thrust(mean_squares(motion), np.array(speed), MASS)
    assert mean_thrust_large(motion, speed, MASS) == pytest.approx(float(steady), abs=3e-6 * scale)


def test_a_tail_that_gives_no_thrust_does_not_swim() -> None:
    assert steady_speed_large(wave(0.05, 8.0, 0.0), FISH, 1.0, 0.3) == 0.0
