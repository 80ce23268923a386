"""A bubble of air under the keel that comes and goes."""

from dataclasses import dataclass

import numpy as np

from benchmarks.reality.instant import Instant
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength

_DRAG_KG_M = 0.25
_SOFT = 8.0  # how sharply it comes and goes


@dataclass(frozen=True)
class TrappedBubble(Mechanism):
    """Drag k |v| v at one place on the keel for part of every stretch of a swim: it grows, tears off, grows again.

    Attributes:
        drag_kg_m: k.
        period_s: between two bubbles.
        part: of the period in which there is one.
        begins: 0 to 1, of the first period.
        place_m: on the keel, in the head's axes.
    """

    drag_kg_m: float
    period_s: float
    part: float
    begins: float
    place_m: float

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """On the head, in water."""
        swing = np.cos(2 * np.pi * (now.time_s / self.period_s - self.begins)) - np.cos(np.pi * self.part)
        wet = now.parameters.density_kg_m3 > 0
        drag = self.drag_kg_m * wet * 0.5 * (1 + np.tanh(_SOFT * swing))
        arm = self.place_m * now.pose.direction[:, :1]
        velocity = now.pose.velocity_m_s[:, :1] + 1j * now.pose.rate_rad_s[:, :1] * arm - now.parameters.current_m_s
        return now.push(0, self.place_m, -drag * np.abs(velocity) * velocity)


def drawn(random: np.random.Generator) -> AtStrength:
    """Every 1.5 to 4 s, there a third to two thirds of the time; 0.25 kg/m at strength 1, linear."""
    period, part, begins = random.uniform(1.5, 4.0), random.uniform(0.33, 0.67), random.random()
    place = random.uniform(-0.05, 0.25)
    return lambda strength: (TrappedBubble(_DRAG_KG_M * strength, period, part, begins, place),) if strength else ()
