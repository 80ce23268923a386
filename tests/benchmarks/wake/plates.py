"""A rigid plate that is moved through water at rest: what the lattice says of it."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from benchmarks.wake.lattice import Bound, Panels, Surface, Wake, Water

STILL = Water(np.zeros((1, 1), complex))
TALL_M = 200.0


class Moved(NamedTuple):
    """One instant: middle and its velocity, complex, angle and rate."""

    place_m: complex
    velocity_m_s: complex
    angle_rad: float = 0.0
    rate_rad_s: float = 0.0


class Plate(NamedTuple):
    """(k,) a step, in water of density 1, over twice the rings' half height; the last bound and wake."""

    force: np.ndarray
    circulation: np.ndarray
    bound: Bound
    wake: Wake


def even_panels(count: int, half_height_m: float = TALL_M, chord_m: float = 1.0) -> Panels:
    return Panels.between(np.linspace(0.0, chord_m, count + 1), np.full(count, half_height_m))


def surface_of(panels: Panels, at: Moved) -> Surface:
    arm = (panels.node_m - panels.node_m[-1] / 2) * np.exp(1j * at.angle_rad)
    return Surface(panels, (at.place_m + arm)[None], (at.velocity_m_s + 1j * at.rate_rad_s * arm)[None])


def swept(
    panels: Panels,
    motion: Callable[[float], Moved],
    step_s: float,
    steps: int,
    *,
    critical: float = 0.0,
    keep: int = 400,
) -> Plate:
    wake: Wake | None = None
    momentum: list[np.ndarray] = []
    lasting, across, circulation = [], [], []
    for k in range(steps):
        surface = surface_of(panels, motion(k * step_s))
        if wake is None:
            wake = Wake.none(surface, 1e-4).moved(-step_s * surface.velocity_m_s[:, -1:])
        wake = wake.followed(surface.node_m[:, -1:])
        bound = Bound(surface, wake, STILL)
        momentum.append((bound.weight_kg_m(1.0) * bound.circulation_m2_s)[0])
        lasting.append(bound.steady_force(1.0, critical)[0].sum())
        across.append(1j * surface.along[0])
        circulation.append(bound.circulation_m2_s[0, -1])
        wake = wake.shed(surface.node_m[:, -1:], bound.circulation_m2_s[:, -1:], keep)
        wake = wake.moved(step_s * bound.carried(wake, STILL))
    assert wake is not None
    growth = np.gradient(np.array(momentum), step_s, axis=0)
    force = np.array(lasting) - (growth * np.array(across)).sum(axis=1)
    return Plate(force / (2 * panels.half_height_m[-1]), np.array(circulation), bound, wake)
