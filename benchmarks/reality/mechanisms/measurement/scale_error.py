"""A length scale taken from two boxes of which one is too far along the body."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reality.camera import Sight
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength

_TYPICAL = 0.02
_NOSE_TO_NECK_M = 0.142


@dataclass(frozen=True)
class ScaleError(Mechanism):
    """The box of nose or neck, or both, sits too far along the line between them, and stays so in the picture.

    Attributes:
        nose_m, neck_m: tailwards along the first frame's line from nose to neck.
    """

    nose_m: float
    neck_m: float

    def place(self, sight: Sight) -> Sight:
        """Two markers, shifted by a constant."""
        nose, neck = sight.names.index("nose"), sight.names.index("neck")
        line = sight.marker_m[0, neck] - sight.marker_m[0, nose]
        marker_m = sight.marker_m.copy()
        marker_m[:, [nose, neck]] += line / abs(line) * np.array([self.nose_m, self.neck_m])
        return replace(sight, marker_m=marker_m)


def drawn(random: np.random.Generator) -> AtStrength:
    """Draws whether the two are too far apart or too close, and the nose's share of it (mostly it is the neck's)."""
    sign, nose_share = random.choice([-1.0, 1.0]), random.uniform(0.0, 0.3)

    def at(strength: float) -> tuple[Mechanism, ...]:
        if strength == 0:
            return ()
        apart_m = float(sign * _TYPICAL * strength * _NOSE_TO_NECK_M)
        return (ScaleError(-float(nose_share) * apart_m, (1 - float(nose_share)) * apart_m),)

    return at
