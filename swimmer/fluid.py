"""MuJoCo's ellipsoid fluid model: the five coefficients, and a numpy reference of the published formulas."""

from typing import NamedTuple


class FluidCoefficients(NamedTuple):
    """The five dimensionless coefficients, in the engine's order."""

    blunt_drag: float
    slender_drag: float
    angular_drag: float
    kutta_lift: float
    magnus_lift: float


PUBLISHED_COEFFICIENTS = FluidCoefficients(0.40, 7.79, 2.81, 3.84, 0.27)
