"""Water that got into the hull and sloshes there."""

from dataclasses import dataclass

import numpy as np

from benchmarks.reality.instant import Instant
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength

_KG = 0.05


@dataclass(frozen=True)
class WaterInHull(Mechanism):
    """A mass on a spring and a damper, as sloshing is modelled (Dodge, NASA SP-106, 2000, chapter 3), in the head.

    The state is where it is in the pool and how fast; so its weight comes on top of the robot's.

    Attributes:
        mass_kg: that takes part.
        slosh_hz: in a hull at rest.
        damping: ratio.
        place_m: of the hull's middle in the head's axes.
    """

    mass_kg: float
    slosh_hz: float
    damping: float
    place_m: float

    def start(self, now: Instant) -> np.ndarray:
        """(n, 4) x, y, and their rates: it moves with the hull."""
        place, velocity = self._hull(now)
        return np.concatenate([place.real, place.imag, velocity.real, velocity.imag], axis=1)

    def advance(self, now: Instant, state: np.ndarray, step_s: float) -> np.ndarray:
        """Leapfrog."""
        pull = self._pull(now, state) / self.mass_kg * step_s
        faster = state[:, 2:] + np.concatenate([pull.real, pull.imag], axis=1)
        return np.concatenate([state[:, :2] + faster * step_s, faster], axis=1)

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:
        """On the hull."""
        return now.push(0, self.place_m, -self._pull(now, state))

    def _hull(self, now: Instant) -> tuple[np.ndarray, np.ndarray]:
        arm = self.place_m * now.pose.direction[:, :1]
        return now.pose.origin_m[:, :1] + arm, now.pose.velocity_m_s[:, :1] + 1j * now.pose.rate_rad_s[:, :1] * arm

    def _pull(self, now: Instant, state: np.ndarray) -> np.ndarray:
        """(n, 1) force on the water, complex."""
        place, velocity = self._hull(now)
        rate = 2 * np.pi * self.slosh_hz
        off, faster = state[:, 0:1] + 1j * state[:, 1:2] - place, state[:, 2:3] + 1j * state[:, 3:4] - velocity
        return np.asarray(-self.mass_kg * (rate**2 * off + 2 * self.damping * rate * faster))


def drawn(random: np.random.Generator) -> AtStrength:
    """50 g at strength 1, linear, sloshing at 0.8 to 2 Hz somewhere in the head."""
    slosh_hz, damping, place = random.uniform(0.8, 2.0), random.uniform(0.03, 0.2), random.uniform(0.0, 0.2)
    return lambda strength: (WaterInHull(_KG * strength, slosh_hz, damping, place),) if strength else ()
