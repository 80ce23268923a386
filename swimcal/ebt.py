"""Elongated body theory: the steady speed and thrust of a swimmer from the motion of its tail.

`steady_speed` and `thrust_polynomial` are the published steady form: Lighthill, "Note on the swimming of slender fish",
J. Fluid Mech. 9 (1960); as printed in "Simple Models, Real Swimming" (2026), whose thrust omits the factor 1/2 that
momentum minus wake energy leaves and that belongs there.

`steady_speed_large` is the large-amplitude form: Lighthill, "Large-amplitude elongated-body theory of fish locomotion",
Proc. R. Soc. B 179 (1971), eq. 8. Averaged over whole beats the reactive thrust is that of the tail tip alone,

    T = m < w dz/dt - 1/2 w^2 cos(theta) >,    w = dz/dt cos(theta) - dx/dt sin(theta),

with x forward and z to the side in water at rest, theta the angle of the tail tip's tangent (pointing forward)
against x, w the velocity across the tail and m its added mass per length. See also Boyer, Porez and Leroyer, J.
Nonlinear Sci. 20 (2010). For small slopes it becomes the steady form.
"""

from typing import NamedTuple

import numpy as np

from swimcal.robot import ElongatedBody, RobotSpec

BETA_BOUNDS = (0.9, 1.1)
DRAG_BOUNDS = (0.0, 10.0)


class TailMotion(NamedTuple):
    """Mean squares over whole beats at the tail tip: <h_t^2> of its lateral speed, m^2/s^2, <h_x^2> of its slope."""

    lateral_speed_sq: np.ndarray
    slope_sq: np.ndarray


def added_mass_per_length(body: ElongatedBody, density_kg_m3: float, beta: float) -> float:
    """Return the added mass per length of a cross section of depth d, kg/m: 1/4 rho pi beta d^2 (Lighthill 1960).

    Args:
        body: the body, with its depth.
        density_kg_m3: density of the water.
        beta: shape factor, 1 for an ellipse.
    """
    return 0.25 * density_kg_m3 * np.pi * beta * body.depth_m**2


def steady_speed(motion: TailMotion, robot: RobotSpec, beta: float, drag_coefficient: float) -> np.ndarray:
    """Return the speed U >= 0 at which mean thrust and drag balance, m/s.

    U^2 = m <h_t^2> / (rho c_D S + m <h_x^2>); depends on beta and c_D only through c_D / beta.

    Args:
        motion: mean squares at the tail tip.
        robot: the robot, with its depth, reference area and water.
        beta: factor of the added mass, about 1.
        drag_coefficient: c_D.
    """
    body, density = robot.elongated_body, robot.water.density_kg_m3
    mass = added_mass_per_length(body, density, beta)
    resistance = density * drag_coefficient * body.reference_area_m2 + mass * motion.slope_sq
    return np.sqrt(mass * motion.lateral_speed_sq / np.maximum(resistance, 1e-12))


class TipMotion(NamedTuple):
    """Motion of the tail tip over whole beats, seen from a frame that swims along at the mean velocity.

    Attributes:
        forward_speed: (n,) dx/dt less its mean, m/s.
        lateral_speed: (n,) dz/dt, m/s.
        angle_rad: (n,) angle of the tangent, pointing forward, against the swimming direction.
    """

    forward_speed: np.ndarray
    lateral_speed: np.ndarray
    angle_rad: np.ndarray


def steady_speed_large(motion: TipMotion, robot: RobotSpec, beta: float, drag_coefficient: float) -> float:
    """Return the speed U >= 0 at which mean thrust and drag 1/2 rho c_D S U^2 balance, m/s.

    Thrust is a quadratic in U, so the balance is one too; it depends on beta and c_D only through c_D / beta. Returns 0
    where the tail gives no thrust.

    Args:
        motion: motion of the tail tip.
        robot: the robot, with its depth, reference area and water.
        beta: factor of the added mass, about 1.
        drag_coefficient: c_D.
    """
    body, density = robot.elongated_body, robot.water.density_kg_m3
    mass = added_mass_per_length(body, density, beta)
    constant, linear, quadratic = (mass * c for c in thrust_polynomial(motion))
    resistance = 0.5 * density * drag_coefficient * body.reference_area_m2 - quadratic
    if constant <= 0 or resistance <= 0:
        return 0.0
    return float((linear + np.sqrt(linear**2 + 4 * resistance * constant)) / (2 * resistance))


def thrust_polynomial(motion: TipMotion) -> tuple[float, float, float]:
    """Return T / m as a polynomial in U: constant, linear and quadratic coefficient.

    The velocity across the tail is w = a - U sin(theta), where a is what the beat alone gives.
    """
    forward, lateral, angle = motion
    cos, sin = np.cos(angle), np.sin(angle)
    across = lateral * cos - forward * sin  # a, at U = 0
    constant = across * lateral - 0.5 * across**2 * cos
    linear = -sin * lateral + across * sin * cos
    quadratic = -0.5 * sin**2 * cos
    return float(constant.mean()), float(linear.mean()), float(quadratic.mean())
