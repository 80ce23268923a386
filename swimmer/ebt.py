"""Elongated body theory in the published steady form.

Lighthill, "Note on the swimming of slender fish", J. Fluid Mech. 9 (1960); as printed in "Simple Models, Real
Swimming" (2026), whose thrust omits the factor 1/2 that momentum minus wake energy leaves and that belongs there.
"""

from typing import NamedTuple

import numpy as np

from swimmer.robot import ElongatedBody, RobotSpec

BETA_BOUNDS = (0.9, 1.1)
DRAG_BOUNDS = (0.0, 10.0)


class TailMotion(NamedTuple):
    """Mean squares of the tail tip's motion over whole beats.

    Attributes:
        lateral_speed_sq: <h_t^2>, of the lateral speed, m^2/s^2.
        slope_sq: <h_x^2>, of the slope against the swimming direction.
    """

    lateral_speed_sq: np.ndarray
    slope_sq: np.ndarray


def added_mass_per_length(body: ElongatedBody, density_kg_m3: float, beta: float) -> float:
    """m = 1/4 rho pi beta d^2, the added mass of a cross section of depth d, kg/m (Lighthill 1960)."""
    return 0.25 * density_kg_m3 * np.pi * beta * body.depth_m**2


def mean_thrust(motion: TailMotion, speed: np.ndarray, mass_per_length: float) -> np.ndarray:
    """T = 1/2 m (<h_t^2> - U^2 <h_x^2>) at the tail tip, N (Lighthill 1960, eq. 12)."""
    return 0.5 * mass_per_length * (motion.lateral_speed_sq - speed**2 * motion.slope_sq)


def steady_speed(motion: TailMotion, robot: RobotSpec, beta: float, drag_coefficient: float) -> np.ndarray:
    """The speed U >= 0 at which mean thrust and drag balance, m/s.

    U^2 = m <h_t^2> / (rho c_D S + m <h_x^2>); depends on beta and c_D only through c_D / beta.
    """
    body, density = robot.elongated_body, robot.water.density_kg_m3
    mass = added_mass_per_length(body, density, beta)
    resistance = density * drag_coefficient * body.reference_area_m2 + mass * motion.slope_sq
    return np.sqrt(mass * motion.lateral_speed_sq / np.maximum(resistance, 1e-12))
