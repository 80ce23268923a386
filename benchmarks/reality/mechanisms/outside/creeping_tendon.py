"""A tendon that grows longer in the course of a session."""

from dataclasses import dataclass

import numpy as np

from benchmarks.reality.instant import Instant
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength
from benchmarks.reality.mechanisms.wear import Wearing

_CREEP_M, _MOST_M = 0.001, 0.008


@dataclass(frozen=True)
class CreepingTendon(Wearing):
    """Knots that settle: after t in use the free length of one tendon has grown by g t / (t + t_half).

    Attributes:
        left_m, right_m: g.
        half_s: t_half.
    """

    left_m: float
    right_m: float
    half_s: float

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """Less tension."""
        in_use_s = np.maximum(self.before_s + now.time_s, 0.0)
        used = in_use_s / (in_use_s + self.half_s)
        grown = np.concatenate([self.left_m * used, self.right_m * used], axis=1)
        return now.tighten(-now.parameters.tendon_stiffness_n_m * grown)


def drawn(random: np.random.Generator) -> AtStrength:
    """Left or right; 1 mm in the end at strength 1, half of it in the first 3 to 10 s; saturates at 8 mm."""
    left, half_s = random.random() < 0.5, random.uniform(3.0, 10.0)

    def at(strength: float) -> tuple[Mechanism, ...]:
        creep = _MOST_M * float(np.tanh(_CREEP_M * strength / _MOST_M))
        return (CreepingTendon(creep * left, creep * (not left), half_s),) if strength else ()

    return at
