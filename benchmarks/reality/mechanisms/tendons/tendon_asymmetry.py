"""Tendons of unequal length: the tail is bent where the crank should hold it straight."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reality.layout import Layout
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength
from benchmarks.reality.parameters import Parameters

_TYPICAL_M, _MOST_M = 0.001, 0.012


@dataclass(frozen=True)
class TendonAsymmetry(Mechanism):
    """Attributes: left_m, right_m, by which either tendon's free length is more than that of the straight tail."""

    left_m: float
    right_m: float

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:  # noqa: ARG002
        """Other lengths."""
        extra_m = parameters.tendon_extra_m + np.array([self.left_m, self.right_m])
        return replace(parameters, tendon_extra_m=extra_m)


def drawn(random: np.random.Generator) -> AtStrength:
    """Draws which side is short, which tendon is the more wrong, and by how much less the other: each has its knot.

    Saturates at 12 mm each.
    """
    sign, shares = random.choice([-1.0, 1.0]), random.permutation([1.0, random.uniform(0.25, 1.0)])

    def at(strength: float) -> tuple[Mechanism, ...]:
        if strength == 0:
            return ()
        left_m, right_m = sign * _MOST_M * np.tanh(_TYPICAL_M / _MOST_M * strength) * shares
        return (TendonAsymmetry(float(-left_m), float(right_m)),)

    return at
