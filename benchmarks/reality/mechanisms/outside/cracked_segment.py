"""A flexible gap that cracks while the robot swims, and stays cracked."""

from dataclasses import dataclass

import numpy as np

from benchmarks.reality.instant import Instant
from benchmarks.reality.mechanisms import AtStrength
from benchmarks.reality.mechanisms.wear import Wearing

_LN = 0.4
_LOADED = 3  # gaps, from the head on, that bear most


@dataclass(frozen=True)
class CrackedSegment(Wearing):
    """From one moment on a gap loses a share of its stiffness, within a few beats, as a crack runs through it.

    Attributes:
        gap: index of the robot's hinge.
        lost: share of its stiffness.
        cracks_s: when half of that is lost; in use, counted from the session's beginning.
        runs_s: how long the crack takes to run, over 4.
    """

    gap: float
    lost: float
    cracks_s: float
    runs_s: float

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """Takes back what the spring no longer exerts."""
        cracked = 0.5 * (1 + np.tanh((self.before_s + now.time_s - self.cracks_s) / (2 * self.runs_s)))
        spring = now.parameters.hinge_stiffness_n_m * (now.pose.hinge_rad - now.parameters.hinge_rest_rad)
        return now.bend(self.lost * cracked * (now.layout.gap_of_hinge == self.gap) * spring)


def drawn(random: np.random.Generator) -> AtStrength:
    """One of the front gaps, 0.5 to 2 s after the beginning; loses a third at strength 1, nearly all at 20."""
    gap, cracks_s, runs_s = float(random.integers(_LOADED)), random.uniform(0.5, 2.0), random.uniform(0.1, 0.4)
    return lambda strength: (
        (CrackedSegment(gap, float(-np.expm1(-_LN * strength)), cracks_s, runs_s),) if strength else ()
    )
