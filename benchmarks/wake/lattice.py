"""Mid line of the swimmer as a vortex lattice, one ring high, and the wake of rings that its trailing edge sheds.

The unsteady vortex-ring method (Katz and Plotkin 2001, section 13.12), in the mid plane: the ring of every panel begins
a quarter behind its leading edge; at three quarters no water passes. The last ring ends at the trailing edge, where the
newest ring of the wake, which has its circulation (Kutta's condition), begins. A panel of half height h is a ring of
half height h / sqrt(2): then a long low plate has the added mass pi rho h^2 a length of slender-body theory (Jones
1946, NACA report 835), and a high one is two-dimensional. Rings are closed, so circulation is conserved.

Unsteady Bernoulli on both sides of the sheet gives, with G_i the potential's jump over ring i, U the water's mean speed
along it, H and l its half height and length, a force across it

    -2 rho (U (H_i G_i - min(H_i, H_(i-1)) G_(i-1)) + H_i l_i dG_i/dt),

its first part at the ring's front: what a lower ring behind a higher one no longer holds has left over the edges.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from benchmarks.wake.filaments import Rings, of_rings, of_sheet

SLENDER = np.sqrt(0.5)
"""Half height of a ring over that of its panel."""
_BEHIND = 0.3
"""Distance of the newest vortex behind the trailing edge, over its way in a step (Katz and Plotkin: 0.2 to 0.3)."""


@dataclass(frozen=True, eq=False)
class Panels:
    """m panels of the straight body, from nose to tail."""

    node_m: np.ndarray  # (m + 1,) places where rings begin, and the trailing edge
    collocation: np.ndarray  # (m,) place in its ring where no water passes, as a share of its length
    half_height_m: np.ndarray  # (m,) half heights of the rings

    @classmethod
    def between(cls, edge_m: np.ndarray, half_height_m: np.ndarray) -> "Panels":
        """Build panels between edges (m + 1,), of half heights (m,) of the body."""
        length = np.diff(edge_m)
        node = np.append(edge_m[:-1] + length / 4, edge_m[-1])
        return cls(node, (length / 2) / np.diff(node), SLENDER * half_height_m)


@dataclass(frozen=True, eq=False)
class Surface:
    """Nodes of the body and how they move: (n, m + 1) complex, m and m/s."""

    panels: Panels
    node_m: np.ndarray
    velocity_m_s: np.ndarray

    @cached_property
    def length_m(self) -> np.ndarray:
        """(n, m) lengths of the rings."""
        return np.abs(np.diff(self.node_m))

    @cached_property
    def along(self) -> np.ndarray:
        """(n, m) unit vectors along the rings."""
        return np.asarray(np.diff(self.node_m) / self.length_m)

    def at_collocation(self, at_nodes: np.ndarray) -> np.ndarray:
        """Return (n, m) where no water passes, of what is known at the nodes (n, m + 1)."""
        return np.asarray(at_nodes[:, :-1] + self.panels.collocation * np.diff(at_nodes))

    def rings(self, core_m: float, edge_core_m: float) -> Rings:
        """Return the rings of the body, whose columns have a core, that at the trailing edge another: the wake's."""
        height = self.panels.half_height_m
        core = np.append(np.full(len(height), core_m), edge_core_m)
        return Rings(self.node_m[:, :-1], self.node_m[:, 1:], height, core[:-1], core[1:])


@dataclass(frozen=True, eq=False)
class Wake:
    """Wake that was shed, the latest first: nodes (n, k + 1), circulations (n, k) of the rings between them."""

    node_m: np.ndarray
    circulation_m2_s: np.ndarray
    half_height_m: float
    core_m: float

    @classmethod
    def none(cls, surface: Surface, core_m: float) -> "Wake":
        """Return the wake before anything was shed."""
        edge = surface.node_m[:, -1:]
        return cls(edge, np.zeros((len(edge), 0)), float(surface.panels.half_height_m[-1]), core_m)

    def velocity(self, place_m: np.ndarray) -> np.ndarray:
        """Return the (n, p) m/s that it induces at places (n, p)."""
        return of_sheet(place_m, self.node_m, self.circulation_m2_s, self.half_height_m, self.core_m)

    def shed(self, edge_m: np.ndarray, circulation_m2_s: np.ndarray, keep: int) -> "Wake":
        """Add the newest ring, from the trailing edge (n, 1), of circulations (n, 1), and cut what is oldest."""
        node = np.concatenate([edge_m, self.node_m], axis=1)[:, : keep + 1]
        circulation = np.concatenate([circulation_m2_s, self.circulation_m2_s], axis=1)[:, :keep]
        return Wake(node, circulation, self.half_height_m, self.core_m)

    def followed(self, edge_m: np.ndarray) -> "Wake":
        """Draw the newest node behind the trailing edge (n, 1), which has moved on."""
        node = self.node_m.copy()
        node[:, :1] += (1 - _BEHIND) * (edge_m - node[:, :1])
        return Wake(node, self.circulation_m2_s, self.half_height_m, self.core_m)

    def moved(self, way_m: np.ndarray) -> "Wake":
        """Carry the wake along by ways (n, k + 1)."""
        return Wake(self.node_m + way_m, self.circulation_m2_s, self.half_height_m, self.core_m)


class Bound:
    """Circulation about the rings of the body, so that no water passes at an instant.

    Args:
        surface: surface of the body.
        wake: wake that was shed before.
        water: everything else that moves the water.
    """

    def __init__(self, surface: Surface, wake: Wake, water: "Water") -> None:
        self.surface, place = surface, surface.at_collocation(surface.node_m)
        moving = surface.at_collocation(surface.velocity_m_s)
        across, rings = 1j * surface.along, surface.rings(0.0, wake.core_m)
        by_ring = water.mirrored(place, lambda at: of_rings(at, rings))  # (n, m, m)
        core = np.array([wake.core_m])
        newest = Rings(surface.node_m[:, -1:], wake.node_m[:, :1], np.array([wake.half_height_m]), core, core)
        by_ring[:, :, -1:] += water.mirrored(place, lambda at: of_rings(at, newest))
        outside = water.velocity(place) + water.mirrored(place, wake.velocity)
        passes = ((moving - outside) * across.conj()).real
        self.response = np.linalg.inv((by_ring * across.conj()[:, :, None]).real)
        self.circulation_m2_s = (self.response @ passes[:, :, None])[..., 0]
        induced = outside + (by_ring @ self.circulation_m2_s[:, :, None])[..., 0]
        self.along_m_s = ((induced - moving) * surface.along.conj()).real

    def carried(self, wake: Wake, water: "Water") -> np.ndarray:
        """Return the (n, k + 1) m/s of the nodes of a wake, the newest of which is at the trailing edge."""
        rings = self.surface.rings(wake.core_m, wake.core_m)

        def induced(place_m: np.ndarray) -> np.ndarray:
            body = of_rings(place_m, rings)
            return wake.velocity(place_m) + (body @ self.circulation_m2_s[:, :, None])[..., 0]

        return water.velocity(wake.node_m) + water.mirrored(wake.node_m, induced)

    def steady_force(self, density_kg_m3: float, critical: np.ndarray | float = 0.0) -> np.ndarray:
        """Return (n, m) N on the fronts of the rings, complex, were circulations to last.

        Args:
            density_kg_m3: density of the water.
            critical: (n, 1) leading-edge parameter up to which the front is sucked ahead.
        """
        height, along = self.surface.panels.half_height_m, self.surface.along
        shared = np.minimum(height, np.append(0.0, height[:-1]))  # by each ring with the one before
        before = np.concatenate([np.zeros_like(self.circulation_m2_s[:, :1]), self.circulation_m2_s[:, :-1]], axis=1)
        step = height * self.circulation_m2_s - shared * before
        speed = self.along_m_s
        at_front = np.concatenate([speed[:, :1], (speed[:, 1:] + speed[:, :-1]) / 2], axis=1)
        force = -2j * density_kg_m3 * at_front * step * along
        force[:, :1] -= self._compute_suction_n(density_kg_m3, critical) * along[:, :1]
        return np.asarray(force)

    def _compute_suction_n(self, density_kg_m3: float, critical: np.ndarray | float) -> np.ndarray:
        """Return (n, 1) N ahead at the nose: of a first vortex G on a panel d long rho G^2 / 4 d a height.

        Such is the strength sqrt(pi d) g of vortices whose sheet begins as g / sqrt(x) (James 1972, Comp. Meth. Appl.
        Mech. Eng. 1, on the accuracy of vortex lattices); with A = g / (2 U sqrt(c)), c the chord, it is pi rho c U^2
        A^2, where A is at most critical (Ramesh et al. 2014).
        """
        panels, length = self.surface.panels, self.surface.length_m
        full = self.circulation_m2_s[:, :1] ** 2 / (4 * length[:, :1])
        most = np.pi * length.sum(axis=1, keepdims=True) * (critical * self.along_m_s[:, :1]) ** 2
        return np.asarray(2 * panels.half_height_m[0] * density_kg_m3 * np.minimum(full, most))

    def weight_kg_m(self, density_kg_m3: float) -> np.ndarray:
        """Return (n, m) momentum across the rings over their circulations; the force is minus its growth."""
        return np.asarray(2 * density_kg_m3 * self.surface.panels.half_height_m * self.surface.length_m)


@dataclass(frozen=True, eq=False)
class Water:
    """Motion of the water besides the fish's: a stream, and a wall that mirrors all else."""

    stream_m_s: np.ndarray  # (n, 1) complex
    wall_m: np.ndarray | None = None  # (n, 1) place on the wall, complex
    normal: np.ndarray | None = None  # (n, 1) unit vector, complex

    def velocity(self, place_m: np.ndarray) -> np.ndarray:
        """Return (n, p) m/s of the stream."""
        return np.broadcast_to(self.stream_m_s, place_m.shape)

    def mirrored(self, place_m: np.ndarray, induced: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Return (n, p) or (n, p, k) what a wall leaves of velocities that are induced at places (n, p)."""
        own = induced(place_m)
        if self.wall_m is None or self.normal is None:
            return own
        behind = self.wall_m - ((place_m - self.wall_m) * self.normal.conj()).conj() * self.normal
        image = induced(behind)
        normal = self.normal.reshape(len(own), *[1] * (own.ndim - 1))
        return np.asarray(own - (image * normal.conj()).conj() * normal)
