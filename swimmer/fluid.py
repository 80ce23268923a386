"""MuJoCo's ellipsoid fluid model: its five coefficients, and the published formulas in numpy.

The formulas are those of MuJoCo's documentation, chapter Computation, section "Ellipsoid model" (after Andersen,
Pesavento and Wang, J. Fluid Mech. 541 (2005)), as restated in "Simple Models, Real Swimming" (2026). The engine
computes the forces of a simulation; this reference exists to check it term by term, because the engine's own
answer has changed between releases (up to 3.12 thin slow ellipsoids got a twentieth of their Kutta lift).

All quantities are in the ellipsoid's own frame, along its semi-axes, at its centre.
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


PUBLISHED_COEFFICIENTS = FluidCoefficients(0.40, 7.79, 2.81, 3.84, 0.27)


class Wrench(NamedTuple):
    """Force (3,) N and torque (3,) N m on an ellipsoid."""

    force: np.ndarray
    torque: np.ndarray


class FluidTerms(NamedTuple):
    """The forces on one ellipsoid, term by term.

    The added-mass term is the velocity-dependent part only: the engine never computes the reaction to acceleration
    (-m_A dv/dt, -I_A dw/dt) that the published equations hold.
    """

    added_mass: Wrench
    drag: Wrench
    magnus_lift: Wrench
    kutta_lift: Wrench
    viscous: Wrench

    @property
    def total(self) -> Wrench:
        """The sum of all terms."""
        return Wrench(sum(t.force for t in self), sum(t.torque for t in self))  # type: ignore[arg-type]


def fluid_terms(
    semi_axes_m: np.ndarray,
    velocity: np.ndarray,
    angular_velocity: np.ndarray,
    coefficients: FluidCoefficients,
    density_kg_m3: float,
    viscosity_pa_s: float,
) -> FluidTerms:
    """Forces and torques on an ellipsoid that moves through still water.

    Args:
        semi_axes_m: (3,) m.
        velocity: (3,) of the centre, m/s.
        angular_velocity: (3,) rad/s.
        coefficients: the five.
        density_kg_m3, viscosity_pa_s: of the water.
    """
    r, v, w, none = semi_axes_m, velocity, angular_velocity, np.zeros(3)
    area = projected_area(r, v)
    return FluidTerms(
        added_mass=_added_mass(r, v, w, density_kg_m3),
        drag=_drag(r, v, w, area, coefficients, density_kg_m3),
        magnus_lift=Wrench(coefficients.magnus_lift * density_kg_m3 * volume(r) * np.cross(w, v), none),
        kutta_lift=Wrench(_kutta_lift(r, v, area, coefficients.kutta_lift * density_kg_m3), none),
        viscous=Wrench(-6 * np.pi * r.mean() * viscosity_pa_s * v, -8 * np.pi * r.mean() ** 3 * viscosity_pa_s * w),
    )


def volume(semi_axes_m: np.ndarray) -> float:
    """4/3 pi r_x r_y r_z, m^3."""
    return float(4 / 3 * np.pi * np.prod(semi_axes_m))


def projected_area(semi_axes_m: np.ndarray, velocity: np.ndarray) -> float:
    """Area of the ellipsoid's shadow along its velocity, m^2 (0 at rest, where no term needs it).

    A = pi sqrt(sum_i (r_j r_k)^4 v_i^2 / sum_i (r_j r_k)^2 v_i^2).
    """
    largest = np.abs(velocity).max()
    if largest == 0:
        return 0.0
    faces, along = np.prod(semi_axes_m) / semi_axes_m, velocity / largest  # (3,) r_j r_k; scaled against underflow
    return float(np.pi * np.sqrt((faces**4 * along**2).sum() / (faces**2 * along**2).sum()))


def added_mass(semi_axes_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(3,) added volumes, m^3, and (3,) added second moments, m^5: times the density, m_A and I_A.

    Lamb, Hydrodynamics, articles 114 and 115; the integrals alpha_i are Carlson's R_D.
    """
    r = semi_axes_m
    alpha = np.array([2 / 3 * np.prod(r) * elliprd(r[i - 2] ** 2, r[i - 1] ** 2, r[i] ** 2) for i in range(3)])
    moments = np.zeros(3)
    for i in range(3):
        (y, z), (a_y, a_z) = (r[i - 2], r[i - 1]), (alpha[i - 2], alpha[i - 1])
        difference, total = y**2 - z**2, y**2 + z**2
        if abs(difference) > 1e-12 * total:
            moments[i] = volume(r) / 5 * difference**2 * (a_z - a_y) / (2 * difference + total * (a_y - a_z))
    return volume(r) * alpha / (2 - alpha), moments


def _added_mass(r: np.ndarray, v: np.ndarray, w: np.ndarray, density: float) -> Wrench:
    """f = (m_A v) x w and g = (m_A v) x v + (I_A w) x w."""
    volumes, moments = added_mass(r)
    momentum, spin = density * volumes * v, density * moments * w
    return Wrench(np.cross(momentum, w), np.cross(momentum, v) + np.cross(spin, w))


def _drag(r: np.ndarray, v: np.ndarray, w: np.ndarray, area: float, c: FluidCoefficients, density: float) -> Wrench:
    """f = -rho |v| [C_blunt A + C_slender (A_max - A)] v and g = -rho |(C_angular I + C_slender (I_max - I)) w| w."""
    _, middle, long = np.sort(r)
    largest_area, largest_moment = np.pi * middle * long, 8 / 15 * np.pi * middle * long**4
    moments = np.array([8 / 15 * np.pi * r[i] * max(r[i - 1], r[i - 2]) ** 4 for i in range(3)])
    resisted = c.angular_drag * moments + c.slender_drag * (largest_moment - moments)
    return Wrench(
        -density * np.linalg.norm(v) * (c.blunt_drag * area + c.slender_drag * (largest_area - area)) * v,
        -density * np.linalg.norm(resisted * w) * w,
    )


def _kutta_lift(r: np.ndarray, v: np.ndarray, area: float, strength: float) -> np.ndarray:
    """f = C rho A cos(alpha) (n x v) x v, n along the shadow's normal n_i = (r_j r_k)^2 v_i, cos(alpha) = n v / |n||v|.

    n is not normalised in the circulation; its length enters cos(alpha) alone.
    """
    normal = (np.prod(r) / r) ** 2 * v
    length, speed = np.linalg.norm(normal), np.linalg.norm(v)
    if length == 0 or speed == 0:
        return np.zeros(3)
    cosine = float(normal @ v) / (length * speed)
    return strength * area * cosine * np.cross(np.cross(normal / length, v), v)
