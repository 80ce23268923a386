"""Water that moves through the pool."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reality.layout import Layout
from benchmarks.reality.mechanisms import AtStrength
from benchmarks.reality.mechanisms.fluid.moving_water import MovingWater
from benchmarks.reality.parameters import Parameters

_SPEED_M_S = 0.015


@dataclass(frozen=True)
class BackgroundCurrent(MovingWater):
    """A steady eddy as wide as the pool, whose middle is far off: velocity i w (z - z_0) at place z.

    Attributes:
        right_m_s, up_m_s: velocity at the pool's origin.
        turning_rad_s: w.
    """

    right_m_s: float
    up_m_s: float
    turning_rad_s: float

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:  # noqa: ARG002
        """What is alike everywhere."""
        return replace(parameters, current_m_s=parameters.current_m_s + self.right_m_s + 1j * self.up_m_s)

    def velocity(self, place_m: np.ndarray) -> np.ndarray:
        """What is not."""
        return np.asarray(1j * self.turning_rad_s * place_m)


def drawn(random: np.random.Generator) -> AtStrength:
    """0.015 m/s at the origin at strength 1, to anywhere; the eddy's middle 4 to 10 m away; linear."""
    angle = random.uniform(0.0, 2 * np.pi)
    right, up = _SPEED_M_S * np.cos(angle), _SPEED_M_S * np.sin(angle)
    turning = random.choice([-1.0, 1.0]) * _SPEED_M_S / random.uniform(4.0, 10.0)
    return lambda strength: (
        (BackgroundCurrent(strength * right, strength * up, strength * turning),) if strength else ()
    )
