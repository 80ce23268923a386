"""A caudal fin that is curved, so that it lifts where it should not."""

from dataclasses import dataclass

import numpy as np

from benchmarks.reality.fluid import StripForces
from benchmarks.reality.instant import Instant
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength

_LIFT = 0.1


@dataclass(frozen=True)
class CamberedFin(Mechanism):
    """Lift 1/2 rho S C |v|^2 across the fin's way through the water, at any angle of attack: a thin aerofoil's camber.

    Attributes:
        lift: C, 4 pi times the camber over the chord (Anderson, Fundamentals of Aerodynamics, section 4.8); positive
            pushes to the right a fin that moves ahead.
    """

    lift: float

    def water(self, now: Instant, forces: StripForces, state: np.ndarray) -> StripForces:  # noqa: ARG002
        """On the last plate; it does no work."""
        strips, flow = now.layout.strips, now.flow
        area = np.where(strips.plate == strips.plate[-1], 2 * strips.half_height_m * strips.length_m, 0.0)
        pressed = 0.5 * now.parameters.density_kg_m3 * area * self.lift * np.hypot(flow.along_m_s, flow.across_m_s)
        return StripForces(
            forces.along_n + pressed * flow.across_m_s, forces.across_n - pressed * flow.along_m_s, forces.torque_n_m
        )


def drawn(random: np.random.Generator) -> AtStrength:
    """To either side; a lift coefficient of about 0.1 at strength 1, linear."""
    lift = _LIFT * random.choice([-1.0, 1.0]) * random.uniform(0.7, 1.4)
    return lambda strength: (CamberedFin(lift * strength),) if strength else ()
