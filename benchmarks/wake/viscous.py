"""Viscous forces, which a potential flow lacks: skin friction, form drag of the hull, separation from its edges.

- Friction -1/2 rho c_f |u| u on both sides of every panel, u along it, c_f of a flat plate at the Reynolds number of
  the whole fish: 1.328 / sqrt(Re) where laminar, 0.074 / Re^0.2 where turbulent, whichever is larger (Schlichting,
  Boundary Layer Theory, chapters 7 and 21; laminar up to some 1e4).
- Form drag -1/2 rho A |U| U of an area A along the head, spread evenly over it.
- Cross-flow -1/2 rho c_d 2 h |v| v on the hull ahead of the tail, v across it: water that separates from its upper and
  lower edge is not in the lattice. The tail, which makes the thrust, has none.
- The suction at the front of a thin plate holds up to a critical leading-edge parameter, beyond which the flow has
  separated (Ramesh et al., J. Fluid Mech. 751, 2014); 0: a sharp edge without any.
"""

from dataclasses import dataclass

import numpy as np

from benchmarks.wake.lattice import Surface, Water

_SLOW_M_S = 1e-4


@dataclass(frozen=True, eq=False)
class Viscous:
    """Viscous forces of n simulations; k panels of the hull come first, of m in all."""

    density_kg_m3: float
    viscosity_m2_s: float
    length_m: float  # length of the fish
    half_height_m: np.ndarray  # (m,) half heights of the body at the panels
    hull: int  # k
    drag_area_m2: np.ndarray  # (n, 1) A
    cross_drag: np.ndarray  # (n, 1) c_d
    roughness: np.ndarray  # (n, 1) factor on the friction
    suction: np.ndarray  # (n, 1) critical leading-edge parameter

    def force(self, surface: Surface, water: Water) -> np.ndarray:
        """Return (n, m) N on the middles of the rings, complex."""
        middle = (surface.node_m[:, 1:] + surface.node_m[:, :-1]) / 2
        moving = (surface.velocity_m_s[:, 1:] + surface.velocity_m_s[:, :-1]) / 2 - water.velocity(middle)
        own = moving * surface.along.conj()
        along, across = own.real, own.imag
        reynolds = np.maximum(np.abs(along), _SLOW_M_S) * self.length_m / self.viscosity_m2_s
        friction = self.roughness * np.maximum(1.328 / np.sqrt(reynolds), 0.074 / reynolds**0.2)
        side = 2 * self.half_height_m * surface.length_m
        force = -0.5 * self.density_kg_m3 * 2 * side * friction * np.abs(along) * along + 0j
        hull = np.arange(side.shape[1]) < self.hull
        force += -0.5j * self.density_kg_m3 * side * hull * self.cross_drag * np.abs(across) * across
        share = hull / hull.sum()
        force += -0.5 * self.density_kg_m3 * self.drag_area_m2 * share * np.abs(along) * along
        return np.asarray(force * surface.along)
