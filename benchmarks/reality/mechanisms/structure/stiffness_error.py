"""Hinges that are stiffer or softer than described."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reality.layout import Layout
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength
from benchmarks.reality.parameters import Parameters

_LN, _UNEVEN = 0.1, 0.05


@dataclass(frozen=True)
class StiffnessError(Mechanism):
    """Each gap of the tail is stiffer by its own factor: one print's error of thickness, nearly alike everywhere.

    Attributes:
        ln_factor: (gaps,) of each gap of the robot, from the head on.
    """

    ln_factor: tuple[float, ...]

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:
        """Other springs."""
        factor = np.exp(np.array(self.ln_factor)[layout.gap_of_hinge])
        return replace(parameters, hinge_stiffness_n_m=parameters.hinge_stiffness_n_m * factor)


def drawn(random: np.random.Generator, gaps: int = 5) -> AtStrength:
    """All stiffer, or all softer, by 10 % at strength 1, uneven by a twentieth of that; exponential in the strength."""
    ln_factor = _LN * random.choice([-1.0, 1.0]) * (1 + _UNEVEN * random.standard_normal(gaps))
    return lambda strength: (StiffnessError(tuple(strength * ln_factor)),) if strength else ()
