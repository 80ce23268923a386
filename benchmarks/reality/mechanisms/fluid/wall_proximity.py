"""A wall of the pool alongside."""

from dataclasses import dataclass

import numpy as np

from benchmarks.reality.fluid import StripForces
from benchmarks.reality.instant import Instant
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength

_NEAREST_M, _AT_ONE_M = 0.12, 0.65
_PLATE_DRAG = 1.2  # broadside; Hoerner, Fluid-Dynamic Drag (1965), chapter 3
_COURSE_S = 1.0
_FENDER_N_M2 = 2000.0  # of a strip that touches, per length and depth of touch


@dataclass(frozen=True)
class WallProximity(Mechanism):
    """The fish's image behind the wall speeds the water up in the gap: suction along it and more drag across.

    The image of a strip of half height h at clearance c is a doublet 2 c away, so the water is faster by a share that
    goes as (h / c)^2; here b = h^2 / (2 c^2 + h^2 / 2), of the size that foils near the ground show (Quinn, Lauder and
    Smits, J. Fluid Mech. 742, 2014). With (1 + b)^2 - 1 for the pressures, u along and v towards the wall, it draws by
    1/2 rho S (2 b + b^2) (u^2 c / sqrt(c^2 + h^2) - 1.2 |v| v). It runs along the fish's course, its mean heading of
    the last second or so, and is a fender where the fish touches it.

    Attributes:
        side: +1 left, -1 right.
        distance_m: from the head's origin at the start.
    """

    side: float
    distance_m: float

    def start(self, now: Instant) -> np.ndarray:
        """(n, 4) where the head is, and which way the wall lies; both as pairs of x and y."""
        origin, normal = now.pose.origin_m[:, :1], -1j * self.side * now.pose.direction[:, :1]
        return np.concatenate([origin.real, origin.imag, normal.real, normal.imag], axis=1)

    def advance(self, now: Instant, state: np.ndarray, step_s: float) -> np.ndarray:
        """The course a step later: the heading, forgotten exponentially."""
        across = -1j * self.side * now.pose.direction[:, :1]
        normal = state[:, 2:3] + 1j * state[:, 3:4]
        normal = normal + -np.expm1(-step_s / _COURSE_S) * (across - normal)
        normal = normal / np.abs(normal)
        return np.concatenate([state[:, :2], normal.real, normal.imag], axis=1)

    def water(self, now: Instant, forces: StripForces, state: np.ndarray) -> StripForces:
        """On every strip by its own clearance."""
        strips = now.layout.strips
        origin, normal = state[:, 0:1] + 1j * state[:, 1:2], state[:, 2:3] + 1j * state[:, 3:4]
        direction = now.pose.direction[:, strips.link]
        place = now.pose.origin_m[:, strips.link] + strips.place_m * direction
        clear = self.distance_m - ((place - origin) * normal.conj()).real
        moving = (now.flow.along_m_s + 1j * now.flow.across_m_s) * direction * normal.conj()
        height, open_m = strips.half_height_m, np.maximum(clear, 0.0)
        faster = height**2 / (2 * open_m**2 + height**2 / 2)
        drawn_in = moving.imag**2 * open_m / np.hypot(open_m, height) - _PLATE_DRAG * np.abs(moving.real) * moving.real
        pressed = now.parameters.density_kg_m3 * height * strips.length_m * (2 * faster + faster**2)
        fender = _FENDER_N_M2 * strips.length_m * np.minimum(clear, 0.0)
        force = (pressed * drawn_in + fender) * normal * direction.conj()
        return StripForces(forces.along_n + force.real, forces.across_n + force.imag, forces.torque_n_m)


def drawn(random: np.random.Generator) -> AtStrength:
    """Left or right, at about 0.65 m at strength 1, coming nearer with more; never nearer than 0.12 m."""
    side, further_m = random.choice([-1.0, 1.0]), (_AT_ONE_M - _NEAREST_M) * random.uniform(0.8, 1.25)
    return lambda strength: (WallProximity(side, _NEAREST_M + further_m / strength),) if strength else ()
