"""Boxes of nose and neck beside their markers: the line between them is turned against the head."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reality.camera import Sight
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength

_TYPICAL_M = 0.003
_FOLLOWS_S = (0.05, 2.0)


@dataclass(frozen=True)
class HeadFrameMisalignment(Mechanism):
    """Either box is placed to one side in the first frame, and its offset turns after the head as the template learns.

    A template that is renewed a little in every frame keeps its offset in the picture at first and takes over how the
    head has turned within its memory: slow turns it follows as if it were glued, a fast beat hardly (Bolme et al.
    2010, Visual object tracking using adaptive correlation filters: a running average with a learning rate).

    Attributes:
        nose_m, neck_m: towards the fish's right side in the first frame.
        follows_s: memory of the template.
    """

    nose_m: float
    neck_m: float
    follows_s: float

    def place(self, sight: Sight) -> Sight:
        """Two markers, shifted to the side as the head lay a while ago."""
        nose, neck = sight.names.index("nose"), sight.names.index("neck")
        line = sight.marker_m[:, neck] - sight.marker_m[:, nose]
        line = line / np.abs(line)
        kept = np.exp(-np.diff(sight.time_s) / self.follows_s)
        side = np.array(line)
        for frame, share in enumerate(kept, 1):
            side[frame] = share * side[frame - 1] + (1 - share) * line[frame]
        marker_m = sight.marker_m.copy()
        marker_m[:, [nose, neck]] += 1j * np.outer(side / np.abs(side), [self.nose_m, self.neck_m])
        return replace(sight, marker_m=marker_m)


def drawn(random: np.random.Generator) -> AtStrength:
    """Draws how the error is shared between the two boxes, to which sides, and for how long a template remembers."""
    angle = random.uniform(0, 2 * np.pi)
    follows_s = float(np.exp(random.uniform(*np.log(_FOLLOWS_S))))

    def at(strength: float) -> tuple[Mechanism, ...]:
        if strength == 0:
            return ()
        off_m = _TYPICAL_M * strength
        return (HeadFrameMisalignment(float(off_m * np.cos(angle)), float(off_m * np.sin(angle)), follows_s),)

    return at
