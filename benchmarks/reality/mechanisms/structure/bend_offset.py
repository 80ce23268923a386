"""A tail that has taken a set: its hinges rest bent."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reality.layout import Layout
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength
from benchmarks.reality.parameters import Parameters

_MEAN_RAD, _MOST_RAD = 0.03, 0.5


@dataclass(frozen=True)
class BendOffset(Mechanism):
    """Curved where it is flexible: each gap rests at an angle in proportion to its length, and more towards one end.

    The tendons keep the lengths at which they hold the tail straight.

    Attributes:
        mean_rad: over the gaps.
        rearward: 0 for an even curvature; 1 if it grows from nothing at the first gap.
    """

    mean_rad: float
    rearward: float

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:
        """Another rest."""
        gap_m = np.array([segment.gap_m for segment in layout.robot.tail.segment])
        curved = gap_m * (1 + self.rearward * np.linspace(-1.0, 1.0, len(gap_m)))
        rest = self.mean_rad * curved / curved.mean() / layout.hinges_per_gap
        return replace(parameters, hinge_rest_rad=parameters.hinge_rest_rad + rest[layout.gap_of_hinge])


def drawn(random: np.random.Generator) -> AtStrength:
    """To either side, 0.03 rad a gap at strength 1; saturates at 0.5 rad."""
    sign, rearward = random.choice([-1.0, 1.0]), random.uniform(-0.4, 0.4)
    return lambda strength: (
        (BendOffset(sign * _MOST_RAD * float(np.tanh(_MEAN_RAD * strength / _MOST_RAD)), rearward),) if strength else ()
    )
