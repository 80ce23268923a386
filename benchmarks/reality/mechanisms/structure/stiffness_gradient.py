"""A tail that is stiffer at one end than at the other."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reality.layout import Layout
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength
from benchmarks.reality.parameters import Parameters

_LN, _MOST_LN = 0.2, 1.5


@dataclass(frozen=True)
class StiffnessGradient(Mechanism):
    """Stiffness grows, or falls, exponentially along the tail, as with a taper of thickness; its mean stays.

    Attributes:
        ln_ratio: of the rearmost hinge to one half-way.
        power: 1 for an even taper; more where the ends differ most, less where the middle does.
    """

    ln_ratio: float
    power: float

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:
        """Other springs."""
        x = layout.origin_m[1:]
        rear = np.interp(x, [x[0], x[-1]], [-1.0, 1.0])
        factor = np.exp(self.ln_ratio * np.sign(rear) * np.abs(rear) ** self.power)
        return replace(parameters, hinge_stiffness_n_m=parameters.hinge_stiffness_n_m * factor / factor.mean())


def drawn(random: np.random.Generator) -> AtStrength:
    """Either end stiffer, by 20 % against the middle at strength 1; saturates at a factor of e^1.5."""
    sign, power = random.choice([-1.0, 1.0]), random.uniform(0.7, 1.5)
    return lambda strength: (
        (StiffnessGradient(sign * _MOST_LN * float(np.tanh(_LN * strength / _MOST_LN)), power),) if strength else ()
    )
