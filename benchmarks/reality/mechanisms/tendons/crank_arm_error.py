"""Crank arms that are longer or shorter than described."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reality.layout import Layout
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength
from benchmarks.reality.parameters import Parameters

_TYPICAL, _SHORTEST, _LONGEST = 0.05, 0.5, 0.018


@dataclass(frozen=True)
class CrankArmError(Mechanism):
    """Attributes: left, right, by which share either tendon's anchor is further from the shaft than described."""

    left: float
    right: float

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:  # noqa: ARG002
        """Other radii."""
        return replace(parameters, anchor_radius_m=parameters.anchor_radius_m * (1 + np.array([self.left, self.right])))


def drawn(random: np.random.Generator) -> AtStrength:
    """Draws longer or shorter, which arm is the more wrong, and by how much less the other: each is drilled by itself.

    Arms become at most a half shorter, and 1.8 % longer: at 2.3 to 6 % the tail of the base state folds in its
    second gap, at once when at rest.
    """
    most = random.choice([-_SHORTEST, _LONGEST])
    shares = random.permutation([1.0, random.uniform(0.4, 1.0)])

    def at(strength: float) -> tuple[Mechanism, ...]:
        if strength == 0:
            return ()
        relative = most * np.tanh(_TYPICAL / abs(most) * strength)
        left, right = relative * shares
        return (CrankArmError(float(left), float(right)),)

    return at
