"""Markers that are not where the description of the robot has them."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reality.camera import Sight
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength
from session import FISHSIM_MARKERS

_TYPICAL_M = 0.004


@dataclass(frozen=True)
class MarkerOffset(Mechanism):
    """Markers are glued beside their places, and their boxes placed beside them.

    What is glued turns with its link; a box keeps its offset as it was in the first frame.

    Attributes:
        offset_m: by name of marker, in the axes of its link: along (tailwards) and across.
        glued: share of it that turns with the link.
    """

    offset_m: tuple[tuple[str, complex], ...]
    glued: float

    def place(self, sight: Sight) -> Sight:
        """Shifted by both."""
        offset = dict(self.offset_m)
        own = np.array([offset.get(name, 0j) for name in sight.names])
        turned = self.glued * sight.axis + (1 - self.glued) * sight.axis[:1]
        return replace(sight, marker_m=sight.marker_m + own * turned)


def drawn(random: np.random.Generator) -> AtStrength:
    """Draws how many markers are off, which ones, where to, and whether by their glue or by their boxes."""
    others = [name for name in FISHSIM_MARKERS if name not in {"nose", "neck"}]
    off = random.choice(others, size=random.integers(1, len(others) + 1), replace=False)
    way = random.standard_normal(len(off)) + 1j * random.standard_normal(len(off))
    glued = random.uniform(0.5, 1.0)

    def at(strength: float) -> tuple[Mechanism, ...]:
        if strength == 0:
            return ()
        offset = tuple((str(name), complex(_TYPICAL_M * strength * by)) for name, by in zip(off, way, strict=True))
        return (MarkerOffset(offset, float(glued)),)

    return at
