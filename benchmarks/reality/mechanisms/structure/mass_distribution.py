"""Mass that sits further back than described."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reality.layout import Layout
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength
from benchmarks.reality.parameters import Parameters
from swimmer.robot import load_robot

_SHARE, _MOST = 0.01, 0.08
_EVEN = 400.0  # of the draw: a tenth more or less on a guide


@dataclass(frozen=True)
class MassDistribution(Mechanism):
    """Lumps at the tendon guides, of glue and markers, that were weighed with the head; the total stays.

    Attributes:
        share: of the head's mass.
        at_guide: (g,) how the lumps share it, from the first guide to the last; they add up to 1.
    """

    share: float
    at_guide: tuple[float, ...]

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:
        """Masses and their moments."""
        head = np.where(np.arange(layout.hinges + 1) == 0, 1 - self.share, 1.0)
        lump = self.share * parameters.link_mass_kg[0, 0] * np.array(self.at_guide)
        added = np.zeros((3, layout.hinges + 1))
        for order in (0, 1, 2):
            np.add.at(added[order], layout.guide_link, lump * layout.guide_place_m**order)
        return replace(
            parameters,
            link_mass_kg=parameters.link_mass_kg * head + added[0],
            link_moment_kg_m=parameters.link_moment_kg_m * head + added[1],
            link_inertia_kg_m2=parameters.link_inertia_kg_m2 * head + added[2],
        )


def drawn(random: np.random.Generator) -> AtStrength:
    """A hundredth of the head's mass at strength 1, shared by the guides nearly as the tail's own mass is.

    Saturates at 8 hundredths.
    """
    robot = load_robot()
    kg = [robot.tail.density_kg_m3 * s.length_m * s.thickness_m * 2 * s.half_height_m for s in robot.tail.segment]
    kg[-1] += robot.caudal_fin.mass_kg
    at_guide = tuple(random.dirichlet(_EVEN * np.array(kg) / sum(kg)))
    return lambda strength: (
        (MassDistribution(_MOST * float(np.tanh(_SHARE * strength / _MOST)), at_guide),) if strength else ()
    )
