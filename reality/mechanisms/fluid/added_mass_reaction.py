"""The inertia of the water that the body accelerates across itself."""

from dataclasses import dataclass, replace

import numpy as np

from reality.layout import Layout
from reality.mechanism import Mechanism
from reality.mechanisms import AtStrength
from reality.parameters import Parameters

_SHARE = 0.2


@dataclass(frozen=True)
class AddedMassReaction(Mechanism):
    """Elongated body theory's reactive force, of strips with pi rho h^2 a length; see `reality.reactive`.

    Attributes:
        share: of the theory, 0 to 1.
    """

    share: float

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:  # noqa: ARG002
        """Another share."""
        return replace(parameters, added_mass_reaction=np.full_like(parameters.added_mass_reaction, self.share))


def drawn(random: np.random.Generator) -> AtStrength:  # noqa: ARG001
    """A fifth of the theory at strength 1, so that the speed stays about what it is; saturates at all of it.

    Nothing is drawn.
    """
    return lambda strength: (AddedMassReaction(1 - (1 - _SHARE) ** strength),) if strength else ()
