"""Boxes of nose and neck beside their markers: the line between them is turned against the head."""

from dataclasses import dataclass, replace

import numpy as np

from reality.camera import Sight
from reality.mechanism import Mechanism
from reality.mechanisms import AtStrength

_TYPICAL_M = 0.003


@dataclass(frozen=True)
class HeadFrameMisalignment(Mechanism):
    """Either box is placed to one side in the first frame, and keeps that offset in the picture as the head turns.

    The side is that of the line from nose to neck as the first frame shows it; on the body the offset turns backwards
    as the head yaws.

    Attributes:
        nose_m, neck_m: towards the fish's right side in the first frame.
    """

    nose_m: float
    neck_m: float

    def place(self, sight: Sight) -> Sight:
        """Two markers, shifted by a constant."""
        nose, neck = sight.names.index("nose"), sight.names.index("neck")
        line = sight.marker_m[0, neck] - sight.marker_m[0, nose]
        marker_m = sight.marker_m.copy()
        marker_m[:, [nose, neck]] += 1j * line / abs(line) * np.array([self.nose_m, self.neck_m])
        return replace(sight, marker_m=marker_m)


def drawn(random: np.random.Generator) -> AtStrength:
    """Draws how the error is shared between the two boxes, and to which sides."""
    angle = random.uniform(0, 2 * np.pi)

    def at(strength: float) -> tuple[Mechanism, ...]:
        if strength == 0:
            return ()
        off_m = _TYPICAL_M * strength
        return (HeadFrameMisalignment(float(off_m * np.cos(angle)), float(off_m * np.sin(angle))),)

    return at
