"""Elongated body theory, of small and of large amplitude, against travelling waves in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import ellipe, ellipk

from swimcal.ebt import TailMotion, TipMotion, added_mass_per_length, steady_speed, steady_speed_large
from tests.swimcal.robots import FISH
from tests.swimcal.thrust import mean_thrust, mean_thrust_large

BODY = FISH.elongated_body
MASS = 7.0  # kg/m
sizes = st.floats(0.01, 10.0)
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


@given(amplitude=st.floats(0.001, 0.2), wave_number=st.floats(0.5, 30.0), angular=sizes, speed=st.floats(0, 2))
def test_thrust_of_a_travelling_wave_is_the_closed_form(
    amplitude: float, wave_number: float, angular: float, speed: float
) -> None:
    """T = 1/4 m A^2 (w^2 - U^2 k^2), with Lighthill's 1/2 and 1/2 from the mean of a squared sine."""
    motion = mean_squares(wave(amplitude, wave_number, angular))
    assert motion.lateral_speed_sq == pytest.approx((amplitude * angular) ** 2 / 2)
    assert motion.slope_sq == pytest.approx((amplitude * wave_number) ** 2 / 2)
    expected = 0.25 * MASS * amplitude**2 * (angular**2 - (speed * wave_number) ** 2)
    scale = MASS * amplitude**2 * (angular**2 + (speed * wave_number) ** 2)
    assert mean_thrust(motion, np.array(speed), MASS) == pytest.approx(expected, abs=1e-12 * scale)


def test_added_mass_of_a_circular_section_is_that_of_the_displaced_water() -> None:
    """m = 1/4 rho pi d^2 at beta = 1; 7.85 kg/m for the robot's tail, as in facts and paper."""
    mass = added_mass_per_length(BODY, 1000.0, 1.0)
    assert mass == pytest.approx(np.pi * 1000.0 * (BODY.depth_m / 2) ** 2)
    assert mass == pytest.approx(7.854, abs=1e-3)


@given(lateral=sizes, slope=sizes, beta=st.floats(0.1, 2.0), drag_coefficient=sizes)
def test_thrust_and_drag_balance_at_the_steady_speed(
    lateral: float, slope: float, beta: float, drag_coefficient: float
) -> None:
    motion = TailMotion(np.array([lateral]), np.array([slope]))
    speed = steady_speed(motion, FISH, beta, drag_coefficient)
    mass = added_mass_per_length(BODY, FISH.water.density_kg_m3, beta)
    drag = 0.5 * FISH.water.density_kg_m3 * drag_coefficient * BODY.reference_area_m2 * speed**2
    np.testing.assert_allclose(mean_thrust(motion, speed, mass), drag, rtol=1e-9, atol=1e-9 * mass)


@given(lateral=sizes, slope=sizes, ratio=st.floats(0.1, 10.0))
def test_only_the_ratio_of_drag_coefficient_and_beta_matters(lateral: float, slope: float, ratio: float) -> None:
    motion = TailMotion(np.array([lateral]), np.array([slope]))
    one = steady_speed(motion, FISH, 0.91, 0.31)
    np.testing.assert_allclose(steady_speed(motion, FISH, 0.91 * ratio, 0.31 * ratio), one, rtol=1e-12)


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
def test_thrust_of_a_large_wave_is_the_closed_form(
    amplitude: float, wave_number: float, angular: float, speed: float
) -> None:
    scale = MASS * amplitude**2 * (angular**2 + (speed * wave_number) ** 2)
    expected = thrust_of_wave(amplitude, wave_number, angular, speed)
    rounding = 1e-9 + 1e-14 / (amplitude * wave_number) ** 2  # where two integrals are subtracted

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
