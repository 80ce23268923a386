"""The thrust of elongated body theory, for references: the product asks for the steady speed alone."""

import numpy as np

from swimcal.ebt import TailMotion, TipMotion, thrust_polynomial


def mean_thrust(motion: TailMotion, speed: np.ndarray, mass_per_length: float) -> np.ndarray:
    """T = 1/2 m (<h_t^2> - U^2 <h_x^2>) at the tail tip, N (Lighthill 1960, eq. 12)."""
    return 0.5 * mass_per_length * (motion.lateral_speed_sq - speed**2 * motion.slope_sq)


def mean_thrust_large(motion: TipMotion, speed: float, mass_per_length: float) -> float:
    """T at a swimming speed (m/s), N."""
    constant, linear, quadratic = thrust_polynomial(motion)
    return mass_per_length * (constant + linear * speed + quadratic * speed**2)
