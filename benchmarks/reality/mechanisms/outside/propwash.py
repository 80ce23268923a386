"""The jet of a pump across part of the pool."""

from dataclasses import dataclass

import numpy as np

from benchmarks.reality.mechanisms import AtStrength
from benchmarks.reality.mechanisms.fluid.moving_water import MovingWater

_SPEED_M_S = 0.015


@dataclass(frozen=True)
class Propwash(MovingWater):
    """A plane jet that lasts: velocity U exp(-(d / b)^2) along its line, d the distance from that.

    The Gaussian profile of Rajaratnam, Turbulent Jets (1976), chapter 1, without the slow widening.

    Attributes:
        speed_m_s: U, on the line.
        heading_rad: of the jet in the pool.
        offset_m: of its line from the pool's origin, to its left.
        width_m: b.
    """

    speed_m_s: float
    heading_rad: float
    offset_m: float
    width_m: float

    def velocity(self, place_m: np.ndarray) -> np.ndarray:
        """Of the jet."""
        along = np.exp(1j * np.asarray(self.heading_rad))
        apart = ((place_m * along.conj()).imag - self.offset_m) / self.width_m
        return np.asarray(self.speed_m_s * np.exp(-(apart**2)) * along)


def drawn(random: np.random.Generator) -> AtStrength:
    """From anywhere, its line within 0.2 m of the origin, 0.2 to 0.5 m wide; 0.015 m/s at strength 1, linear."""
    heading, offset = random.uniform(0.0, 2 * np.pi), random.uniform(-0.2, 0.2)
    width = random.uniform(0.2, 0.5)
    return lambda strength: (Propwash(_SPEED_M_S * strength, heading, offset, width),) if strength else ()
