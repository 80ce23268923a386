"""Hinges that stiffen as they bend."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reality.instant import Instant
from benchmarks.reality.layout import Layout
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength
from benchmarks.reality.parameters import Parameters

_CUBIC = 2.0  # 1/rad^2, where the bend is small


@dataclass(frozen=True)
class StiffnessHardening(Mechanism):
    """A toe and then a steeper line: torque k (q + r (q - a arctan(q / a))) of a gap at bend q.

    Slopes k where straight and k (1 + r) where far bent, as of a gap whose edges come to bear; k (1 + r q^2 / 3 a^2) q
    between.

    Attributes:
        ratio: r.
        toe_rad: a.
    """

    ratio: float
    toe_rad: float

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:  # noqa: ARG002
        """The steepest slope is taken implicitly."""
        extra = parameters.extra_implicit_stiffness_n_m + self.ratio * parameters.hinge_stiffness_n_m
        return replace(parameters, extra_implicit_stiffness_n_m=extra)

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """What comes on top of Hooke's law; hinges in series share the bend of their gap."""
        toe = self.toe_rad / now.layout.hinges_per_gap
        bent = now.pose.hinge_rad - now.parameters.hinge_rest_rad
        return now.bend(-self.ratio * now.parameters.hinge_stiffness_n_m * (bent - toe * np.arctan(bent / toe)))


def drawn(random: np.random.Generator) -> AtStrength:
    """At strength 1 the torque of a slight bend is k q (1 + 2 q^2); the slope at a large one is linear in strength."""
    toe = random.uniform(0.15, 0.3)
    return lambda strength: (StiffnessHardening(3 * toe**2 * _CUBIC * strength, toe),) if strength else ()
