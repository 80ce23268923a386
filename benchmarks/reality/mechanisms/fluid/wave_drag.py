"""Waves that a swimmer at the surface makes and leaves behind."""

from dataclasses import dataclass

import numpy as np

from benchmarks.reality.instant import Instant
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength

_GRAVITY_M_S2 = 9.81
_ON_HUMP = 0.5
_WATERLINE_M = 0.1  # behind the head's origin, where the hull is widest


@dataclass(frozen=True)
class WaveDrag(Mechanism):
    """Drag 1/2 rho S c(Fr) U^2 on the head, c a bell over the logarithm of the Froude number U / sqrt(g L).

    c = c_0 exp(-ln(Fr / Fr_0)^2 / 2 s^2): the envelope of measured hulls, hump and all (Hoerner, Fluid-Dynamic Drag,
    1965, chapter 11), L the length of the keel.

    Attributes:
        on_hump: c_0.
        hump_froude: Fr_0.
        width: s.
    """

    on_hump: float
    hump_froude: float
    width: float

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """Against the head's way through the water."""
        robot, direction = now.layout.robot, now.pose.direction[:, :1]
        still = now.parameters.current_m_s
        speed = ((now.pose.velocity_m_s[:, :1] - still) * direction.conj()).real
        froude = np.abs(speed) / np.sqrt(_GRAVITY_M_S2 * 2 * robot.head.fluid_half_size_m[0])
        apart = np.log(np.maximum(froude, 1e-9) / self.hump_froude) / self.width
        pressed = 0.5 * now.parameters.density_kg_m3 * robot.elongated_body.reference_area_m2
        drag = -pressed * self.on_hump * np.exp(-(apart**2) / 2) * np.abs(speed) * speed
        return now.push(0, _WATERLINE_M, drag * direction)


def drawn(random: np.random.Generator) -> AtStrength:
    """0.5 on the hump at strength 1, linear; the hump at Fr 0.48 to 0.52, more or less wide."""
    hump, width = random.uniform(0.48, 0.52), random.uniform(0.41, 0.45)
    return lambda strength: (WaveDrag(_ON_HUMP * strength, hump, width),) if strength else ()
