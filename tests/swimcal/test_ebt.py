import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swimcal.ebt import TailMotion, added_mass_per_length, steady_speed
from tests.swimcal.robots import FISH
from tests.swimcal.thrust import mean_thrust

BODY = FISH.elongated_body
sizes = st.floats(0.01, 10.0)


def travelling_wave(amplitude_m: float, wave_number: float, angular_rad_s: float) -> TailMotion:
    """Mean squares at a fixed place of h = A cos(k x - w t), averaged over one beat."""
    time_s = np.linspace(0, 2 * np.pi / angular_rad_s, 400, endpoint=False)
    phase = wave_number * 0.4 - angular_rad_s * time_s
    h_t = amplitude_m * angular_rad_s * np.sin(phase)
    h_x = -amplitude_m * wave_number * np.sin(phase)
    return TailMotion(np.asarray(np.mean(h_t**2)), np.asarray(np.mean(h_x**2)))


@given(amplitude=st.floats(0.001, 0.2), wave_number=st.floats(0.5, 30.0), angular=sizes, speed=st.floats(0, 2))
def test_thrust_of_a_travelling_wave_is_the_closed_form(
    amplitude: float, wave_number: float, angular: float, speed: float
) -> None:
    """T = 1/4 m A^2 (w^2 - U^2 k^2), with Lighthill's 1/2 and 1/2 from the mean of a squared sine."""
    motion = travelling_wave(amplitude, wave_number, angular)
    assert motion.lateral_speed_sq == pytest.approx((amplitude * angular) ** 2 / 2)
    assert motion.slope_sq == pytest.approx((amplitude * wave_number) ** 2 / 2)
    expected = 0.25 * 7.0 * amplitude**2 * (angular**2 - (speed * wave_number) ** 2)
    scale = 7.0 * amplitude**2 * (angular**2 + (speed * wave_number) ** 2)
    assert mean_thrust(motion, np.array(speed), 7.0) == pytest.approx(expected, abs=1e-12 * scale)


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
