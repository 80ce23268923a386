"""A sensor that is read line by line."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from benchmarks.reality.camera import Picture
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength

_TYPICAL_S, _MOST_S = 0.01, 0.04
_ROUNDS = 6


@dataclass(frozen=True)
class RollingShutter(Mechanism):
    """Each marker is drawn where it is when the line it is drawn on is read.

    The instant is solved for, not taken to first order. Meingast, Geyer and Sastry (2005), Geometric models of
    rolling-shutter cameras.

    Attributes:
        readout_s: from the first line to the last.
        stamped: share of the lines that are read before the instant that the frame is said to be of.
    """

    readout_s: float
    stamped: float

    def picture(self, picture: Picture) -> Picture:
        """From the paths through all frames; fixed points of x(t + readout (line / lines - stamped))."""
        time_s, lines = picture.time_s, picture.camera.height_px
        found = picture.position_px.copy()
        for marker in range(found.shape[1]):
            path = CubicSpline(time_s, picture.position_px[:, marker])
            at = found[:, marker]
            for _ in range(_ROUNDS):
                at = path(time_s + self.readout_s * ((at[:, 1] + 0.5) / lines - self.stamped))
            found[:, marker] = at
        return replace(picture, position_px=found)


def drawn(random: np.random.Generator) -> AtStrength:
    """Draws which line a frame's stamp belongs to; the readout saturates at 40 ms."""
    stamped = random.uniform(0.3, 0.7)

    def at(strength: float) -> tuple[Mechanism, ...]:
        if strength == 0:
            return ()
        return (RollingShutter(float(_MOST_S * np.tanh(_TYPICAL_S / _MOST_S * strength)), float(stamped)),)

    return at
