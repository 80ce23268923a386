"""Chain and water together: the added mass is part of the mass matrix, the rest of the wake's force lags by one step.

The force of the wake on the coordinates q is Q - d/dt(B^T P), with P the momentum across the rings: of it, the share
that q'' makes at once, M_a q'' with M_a = B^T W A^-1 B, is taken implicitly, as without that light bodies in water
blow up (Causin, Gerbeau and Nobile 2005, on added mass); what the wake and the turning of the rings change is carried
over from the last step, and Q is extrapolated (Adams and Bashforth).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from benchmarks.reality.body import Pose
from benchmarks.reality.layout import Layout
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.motion import Equations, Motion
from benchmarks.reality.parameters import Parameters
from benchmarks.wake.lattice import Bound, Panels, Surface, Wake, Water
from benchmarks.wake.viscous import Viscous

HEAD_PANELS = 8
_TAIL_PANELS = 7
_FIN_PANELS = 3
CORE_M = 0.012  # core of the wake's vortices
_KEPT_RINGS = 90  # A wake keeps this many rings.


def panels_of(layout: Layout, fineness: int = 1) -> Panels:
    """Return the straight fish: head, tail and fin in even panels, each as high as the strip in its middle."""
    strips, robot = layout.strips, layout.robot
    middle = layout.origin_m[strips.link] + strips.place_m
    fin = robot.fin_root_x_m + robot.caudal_fin.centre_m + np.array([-0.5, 0.5]) * robot.caudal_fin.chord_m
    ends = (middle[0] - strips.length_m[0] / 2, robot.tail.start_m, *fin)
    counts = (fineness * HEAD_PANELS, fineness * _TAIL_PANELS, fineness * _FIN_PANELS)
    cut = [np.linspace(low, high, n, endpoint=False) for low, high, n in zip(ends[:-1], ends[1:], counts, strict=True)]
    edge = np.append(np.concatenate(cut), ends[-1])
    centre = (edge[1:] + edge[:-1]) / 2
    nearest = np.abs(centre[:, None] - middle).argmin(axis=1)
    height = np.where(centre > fin[0], strips.half_height_m[-1], strips.half_height_m[nearest])
    return Panels.between(edge, height)


class _Nodes:
    """The lattice's nodes on the links of the chain."""

    def __init__(self, layout: Layout, panels: Panels) -> None:
        origin = layout.origin_m
        self.link = np.maximum(np.searchsorted(origin, panels.node_m, side="right") - 1, 0)
        self.place_m = panels.node_m - origin[self.link]
        links = np.arange(len(origin))
        ahead = (links < self.link[:, None]) * layout.reach_m
        self._lever = ahead + (links == self.link[:, None]) * self.place_m[:, None]  # (m + 1, l)

    def surface(self, panels: Panels, pose: Pose) -> Surface:
        """Return where the nodes are and how they move."""
        arm = self.place_m * pose.direction[:, self.link]
        velocity = pose.velocity_m_s[:, self.link] + 1j * pose.rate_rad_s[:, self.link] * arm
        return Surface(panels, pose.origin_m[:, self.link] + arm, velocity)

    def jacobian(self, pose: Pose) -> np.ndarray:
        """Return the (n, m + 1, N) velocity of the nodes over the rates of the coordinates, complex."""
        turned = 1j * self._lever * pose.direction[:, None]
        moved = np.broadcast_to(np.array([1.0, 1j]), (*turned.shape[:2], 2))
        return np.concatenate([moved, turned], axis=2)


class WakeMotion(Motion):
    """n simulations of one layout in water that holds their wakes.

    Args:
        layout: layout of the fish.
        parameters: n rows, already prepared by the mechanisms; their density is set to 0, which takes out the strips.
        mechanisms: n tuples of the mechanisms that act.
        crank: (n,) turns a second, and (n,) angles at time 0.
        panels: panels of the fish.
        viscous: viscous forces of the water.
        water: motion of the water besides the fish's.
        step_s: step of the wake, s.
    """

    def __init__(
        self,
        layout: Layout,
        parameters: Parameters,
        crank: tuple[np.ndarray, np.ndarray],
        mechanisms: Sequence[Sequence[Mechanism]],
        panels: Panels,
        viscous: Viscous,
        water: Water,
        step_s: float,
    ) -> None:
        dry = np.zeros_like(parameters.density_kg_m3)
        super().__init__(layout, replace(parameters, density_kg_m3=dry), *crank, mechanisms)
        self._panels, self._viscous, self._outside = panels, viscous, water
        self._wake_step_s, self._nodes = step_s, _Nodes(layout, panels)
        self.wake: Wake | None = None
        count = layout.hinges + 3
        self._held_force = np.zeros((len(parameters), count))
        self._held_mass = np.zeros((len(parameters), count, count))
        self._before: tuple[np.ndarray, ...] | None = None

    def equations(
        self, time_s: np.ndarray, position: np.ndarray, velocity: np.ndarray, states: list[np.ndarray], step_s: float
    ) -> Equations:
        """Build the equations of the chain in the water as it is held during a step of the wake."""
        dry = super().equations(time_s, position, velocity, states, step_s)
        pose = dry.now.pose
        jacobian = self._nodes.jacobian(pose)
        surface = self._nodes.surface(self._panels, pose)
        viscous = self._viscous.force(surface, self._outside)
        force = dry.force + self._held_force + _project_on_coordinates(_average_middles(jacobian), viscous)
        return replace(dry, mass=dry.mass + self._held_mass, force=force)

    def renew(self, position: np.ndarray, velocity: np.ndarray) -> None:
        """Solve for the circulations, shed, carry the wake along, and hold the force for the step to come."""
        pose, h = self.chain.pose(position, velocity), self._wake_step_s
        surface, jacobian = self._nodes.surface(self._panels, pose), self._nodes.jacobian(pose)
        edge, water = surface.node_m[:, -1:], self._outside
        if self.wake is None:
            still = surface.velocity_m_s[:, -1:] - water.velocity(edge)
            self.wake = Wake.none(surface, CORE_M).moved(-h * still)
        wake = self.wake.followed(edge)
        bound = Bound(surface, wake, water)
        across = 1j * surface.along
        middles = (_average_middles(jacobian) * across.conj()[:, :, None]).real
        share = self._panels.collocation[:, None]
        collocated = jacobian[:, :-1] + share * (jacobian[:, 1:] - jacobian[:, :-1])
        passes = (collocated * across.conj()[:, :, None]).real
        weight = bound.weight_kg_m(self._viscous.density_kg_m3)
        at_once = weight[:, :, None] * (bound.response @ passes)  # (n, m, N) momentum over the rates
        momentum = weight * bound.circulation_m2_s
        carried = _project_on_coordinates(
            jacobian[:, :-1], bound.steady_force(self._viscous.density_kg_m3, self._viscous.suction)
        )
        before = self._before or (momentum, velocity, carried)
        growth = (momentum - before[0] - (at_once @ (velocity - before[1])[:, :, None])[..., 0]) / h
        turned = np.swapaxes(middles, 1, 2)
        self._held_mass = turned @ at_once
        self._held_force = 1.5 * carried - 0.5 * before[2] - (turned @ growth[:, :, None])[..., 0]
        self._before = (momentum, velocity.copy(), carried)
        wake = wake.shed(edge, bound.circulation_m2_s[:, -1:], _KEPT_RINGS)
        self.wake = wake.moved(h * bound.carried(wake, water))


def _average_middles(jacobian: np.ndarray) -> np.ndarray:
    return (jacobian[:, 1:] + jacobian[:, :-1]) / 2


def _project_on_coordinates(jacobian: np.ndarray, force_n: np.ndarray) -> np.ndarray:
    """Return the (n, N) generalised force of forces (n, k), complex, at places of a Jacobian (n, k, N)."""
    return np.asarray((jacobian.conj() * force_n[:, :, None]).real.sum(axis=1))
