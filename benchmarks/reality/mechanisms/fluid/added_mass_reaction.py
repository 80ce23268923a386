"""The inertia of the water that the body accelerates across itself."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reality.layout import Layout
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength
from benchmarks.reality.parameters import Parameters

_SHARE = 0.2


@dataclass(frozen=True)
class AddedMassReaction(Mechanism):
    """Elongated body theory's reactive force, of strips with pi rho h^2 a length but for the ends of the body.

    See `reality.reactive`. The theory takes the body for endless. Around an end water escapes, and less of it is
    accelerated: the loss falls off over a half height (Newman, Marine Hydrodynamics, 1977, on slender bodies: strips
    hold some diameters from the ends).

    Attributes:
        share: of the theory, 0 to 1.
        lost: share of that which is lost at the very ends.
    """

    share: float
    lost: float = 0.0

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:
        """Another share, less at the ends."""
        strips = layout.strips
        along_m = np.cumsum(strips.length_m) - strips.length_m / 2
        from_end_m = np.minimum(along_m, strips.length_m.sum() - along_m)
        share = self.share * (1 - self.lost * np.exp(-from_end_m / strips.half_height_m))
        return replace(parameters, added_mass_reaction=np.zeros_like(parameters.added_mass_reaction) + share)


def drawn(random: np.random.Generator) -> AtStrength:
    """A fifth of the theory at strength 1, so that the speed stays about what it is; saturates at all of it.

    Draws how much is lost at the ends.
    """
    lost = random.uniform(0.2, 0.6)
    return lambda strength: (AddedMassReaction(1 - (1 - _SHARE) ** strength, lost),) if strength else ()
