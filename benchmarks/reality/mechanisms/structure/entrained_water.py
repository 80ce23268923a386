"""Water that the tail carries along."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reality.layout import Layout
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength
from benchmarks.reality.parameters import Parameters

_MEAN_M, _MOST_M = 0.002, 0.02


@dataclass(frozen=True)
class EntrainedWater(Mechanism):
    """A layer on both sides of tail and fin that deepens rearwards, as boundary layers do; none in air.

    With s the place between the first hinge (0) and the rear edge (1), the layer is t (1 + p) s^p deep.

    Attributes:
        mean_m: t, mean depth over the tail's length.
        power: p.
    """

    mean_m: float
    power: float

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:
        """Heavier links behind the head, the water on either side hanging on their surface."""
        strips = layout.strips
        x = layout.origin_m[strips.link] + strips.place_m
        along = np.clip((x - layout.origin_m[1]) / (x[-1] + strips.length_m[-1] / 2 - layout.origin_m[1]), 0.0, 1.0)
        depth = self.mean_m * (1 + self.power) * along**self.power
        density = parameters.density_kg_m3[0, 0]
        kg = np.where(strips.link > 0, 2 * depth * 2 * strips.half_height_m * strips.length_m * density, 0.0)
        added = np.zeros((3, layout.hinges + 1))
        for order in (0, 1, 2):
            np.add.at(added[order], strips.link, kg * strips.place_m**order)
        np.add.at(added[2], strips.link, kg * (strips.length_m**2 / 12 + depth**2 / 3))
        return replace(
            parameters,
            link_mass_kg=parameters.link_mass_kg + added[0],
            link_moment_kg_m=parameters.link_moment_kg_m + added[1],
            link_inertia_kg_m2=parameters.link_inertia_kg_m2 + added[2],
        )


def drawn(random: np.random.Generator) -> AtStrength:
    """2 mm on the mean at strength 1, deepening with the power 0.3 to 0.8; saturates at 20 mm."""
    power = random.uniform(0.3, 0.8)
    return lambda strength: (
        (EntrainedWater(_MOST_M * float(-np.expm1(-_MEAN_M * strength / _MOST_M)), power),) if strength else ()
    )
