"""Water that moves with a velocity of its own from place to place."""

from dataclasses import dataclass

import numpy as np

from benchmarks.reality.fluid import Flow, StripForces, Water
from benchmarks.reality.instant import Instant
from benchmarks.reality.mechanism import Mechanism


@dataclass(frozen=True)
class MovingWater(Mechanism):
    """The strips' quasi-steady forces are those of their motion relative to the water around them."""

    def velocity(self, place_m: np.ndarray) -> np.ndarray:
        """(n, s) of the water at places in the pool, over the current everywhere; complex, m/s and m."""
        raise NotImplementedError

    def water(self, now: Instant, forces: StripForces, state: np.ndarray) -> StripForces:  # noqa: ARG002
        """What changes in the quasi-steady forces comes on top."""
        strips, pose = now.layout.strips, now.pose
        direction = pose.direction[:, strips.link]
        relative = self.velocity(pose.origin_m[:, strips.link] + strips.place_m * direction) * direction.conj()
        flow = Flow(now.flow.along_m_s - relative.real, now.flow.across_m_s - relative.imag, now.flow.rate_rad_s)
        moved, still = Water(now.layout, now.parameters, now.chain).forces(flow), now.water
        return StripForces(
            forces.along_n + (moved.along_n - still.along_n),
            forces.across_n + (moved.across_n - still.across_n),
            forces.torque_n_m + (moved.torque_n_m - still.torque_n_m),
        )
