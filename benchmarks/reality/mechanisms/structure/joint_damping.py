"""Hinges that damp more or less than described."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reality.instant import Instant
from benchmarks.reality.layout import Layout
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength
from benchmarks.reality.parameters import Parameters

_SHARE, _LEAST, _MORE_OFTEN = 0.5, 0.9, 0.75


@dataclass(frozen=True)
class JointDamping(Mechanism):
    """A damper beside the hinge's own whose fluid thins with shear: torque c r w / (1 + |w| / w_0), w the bend's rate.

    Attributes:
        share: r, of the damping c that the robot is said to have; negative: some of that is missing.
        thinning_rad_s: w_0, of a gap.
    """

    share: float
    thinning_rad_s: float

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:  # noqa: ARG002
        """Its slope where slow is taken implicitly."""
        own = max(self.share, 0.0) * parameters.hinge_damping_n_m_s
        return replace(parameters, extra_implicit_damping_n_m_s=parameters.extra_implicit_damping_n_m_s + own)

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """What comes on top of the hinge's own damper."""
        rate = now.pose.hinge_rate_rad_s
        thinned = rate / (1 + np.abs(rate) * now.layout.hinges_per_gap / self.thinning_rad_s)
        return now.bend(-self.share * now.parameters.hinge_damping_n_m_s * thinned)


def drawn(random: np.random.Generator) -> AtStrength:
    """Mostly more: by half at 1 rad/s at strength 1, linear; else less, saturating short of none at all."""
    more, thinning = random.random() < _MORE_OFTEN, random.uniform(2.0, 6.0)

    def share(strength: float) -> float:
        linear = _SHARE * strength
        return linear * (1 + 1 / thinning) if more else -_LEAST * float(np.tanh(linear / _LEAST))

    return lambda strength: (JointDamping(share(strength), thinning),) if strength else ()
