"""A head and a caudal fin whose fluid coefficients are not those of the tail."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reality.layout import Layout
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength
from benchmarks.reality.parameters import Parameters

_LN, _MOST_LN, _UNEVEN = 0.3, 2.0, 0.07


@dataclass(frozen=True)
class SegmentCoefficients(Mechanism):
    """The five coefficients of keel and fin, each by a factor of its own, as drag and lift depend on shape unequally.

    Attributes:
        ln_head, ln_fin: (5,) ln of the factors on blunt, slender and angular drag, Kutta and Magnus lift.
    """

    ln_head: tuple[float, ...]
    ln_fin: tuple[float, ...]

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:
        """On the first plate and the last."""
        plate = layout.strips.plate
        ln = np.outer(self.ln_head, plate == plate[0]) + np.outer(self.ln_fin, plate == plate[-1])
        return replace(parameters, coefficients=parameters.coefficients * np.exp(ln))


def drawn(random: np.random.Generator) -> AtStrength:
    """Any mix of head and fin, more or less of either, by e^0.3 at strength 1; saturates at e^2."""
    angle = random.uniform(0.0, 2 * np.pi)
    head, fin = np.outer([np.cos(angle), np.sin(angle)], np.ones(5)) * (1 + _UNEVEN * random.standard_normal((2, 5)))

    def at(strength: float) -> tuple[Mechanism, ...]:
        size = _MOST_LN * np.tanh(_LN * strength / _MOST_LN)
        return (SegmentCoefficients(tuple(size * head), tuple(size * fin)),) if strength else ()

    return at
