"""The five coefficients of MuJoCo's ellipsoid fluid model, and the water that an ellipsoid carries.

The model is that of MuJoCo's documentation, chapter Computation, section "Ellipsoid model" (after Andersen, Pesavento
and Wang, J. Fluid Mech. 541 (2005)), as restated in "Simple Models, Real Swimming" (2026).
"""

from typing import NamedTuple

import numpy as np
from scipy.special import elliprd


class FluidCoefficients(NamedTuple):
    """The five dimensionless coefficients, in the engine's order."""

    blunt_drag: float
    slender_drag: float
    angular_drag: float
    kutta_lift: float
    magnus_lift: float


COEFFICIENT_BOUNDS = (0.0, 10.0)
"""Bounds within which each coefficient is fitted, as published."""
PUBLISHED_COEFFICIENTS = FluidCoefficients(0.40, 7.79, 2.81, 3.84, 0.27)


def added_volumes(semi_axes_m: np.ndarray) -> np.ndarray:
    """Return the volumes of water (3,) that an ellipsoid carries along each axis, m^3.

    Times the density they are its added masses. Lamb, Hydrodynamics, article 114; the integrals alpha_i are Carlson's
    R_D.
    """
    r = semi_axes_m
    alpha = np.array([2 / 3 * np.prod(r) * elliprd(r[i - 2] ** 2, r[i - 1] ** 2, r[i] ** 2) for i in range(3)])
    return np.asarray(float(4 / 3 * np.pi * np.prod(r)) * alpha / (2 - alpha))
