"""A cable from the head to the side of the pool."""

from dataclasses import dataclass

import numpy as np

from benchmarks.reality.instant import Instant
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength

_WEIGHT_N_M, _DRAG_KG_M = 0.04, 0.05
_STRAIGHT = 0.05  # sag over span of a cable that is all paid out


@dataclass(frozen=True)
class Tether(Mechanism):
    """A sagging cable pulls harder the further off its post is, and is dragged along sideways through the water.

    A parabola of span d and length l sags by f^2 = 3 d (l - d) / 8 and pulls by w d^2 / 8 f (Irvine, Cable Structures,
    1981, section 2.2), with w its weight in water per length.

    Attributes:
        post_x_m, post_y_m: in the pool.
        length_m: l.
        weight_n_m: w.
        drag_kg_m: force over the head's speed squared.
    """

    post_x_m: float
    post_y_m: float
    length_m: float
    weight_n_m: float
    drag_kg_m: float

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """On the head's origin."""
        away = self.post_x_m + 1j * self.post_y_m - now.pose.origin_m[:, :1]
        span = np.abs(away)
        sag = np.sqrt(3 / 8 * span * np.maximum(self.length_m - span, 0.0) + (_STRAIGHT * span) ** 2 + 1e-9)
        pull = self.weight_n_m * span**2 / (8 * sag) * away / (span + 1e-9)
        velocity = now.pose.velocity_m_s[:, :1]
        return now.push(0, 0.0, pull - self.drag_kg_m * np.abs(velocity) * velocity)


def drawn(random: np.random.Generator) -> AtStrength:
    """A post 1.5 to 2.5 m off, 3 m of cable; weight and drag are linear in the strength."""
    post = random.uniform(1.5, 2.5) * np.exp(1j * random.uniform(0.0, 2 * np.pi))
    weight, drag = _WEIGHT_N_M * random.uniform(0.7, 1.4), _DRAG_KG_M * random.uniform(0.5, 2.0)
    return lambda strength: (
        (Tether(float(post.real), float(post.imag), 3.0, strength * weight, strength * drag),) if strength else ()
    )
