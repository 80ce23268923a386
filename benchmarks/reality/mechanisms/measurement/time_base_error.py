"""A camera whose clock is wrong."""

from dataclasses import dataclass

import numpy as np

from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength

_TYPICAL, _MOST = 0.02, 0.5
_SWAY_S = 3.0


@dataclass(frozen=True)
class TimeBaseError(Mechanism):
    """Frames lie further apart than their stamps say: by the share `relative` in the long run, now more and now less.

    The clock's oscillator sways about its mean by the share `sway` of the error, with a period of three seconds.

    Attributes:
        relative: of a second on the camera's clock, how much longer it lasts; more than -1 / (1 + sway).
        sway: 0 to 1.
        phase_rad: of the sway at the first frame.
    """

    relative: float
    sway: float
    phase_rad: float

    def expose(self, time_s: np.ndarray) -> np.ndarray:
        """True times: the integral of 1 + relative (1 + sway cos(w t + phase))."""
        w = 2 * np.pi / _SWAY_S
        swayed = (np.sin(w * time_s + self.phase_rad) - np.sin(self.phase_rad)) / w
        return np.asarray(time_s + self.relative * (time_s + self.sway * swayed))


def drawn(random: np.random.Generator) -> AtStrength:
    """Draws a clock that is fast or slow, and how it sways; the error saturates at a half."""
    sign, sway, phase = random.choice([-1.0, 1.0]), random.uniform(0.0, 0.1), random.uniform(0, 2 * np.pi)

    def at(strength: float) -> tuple[Mechanism, ...]:
        if strength == 0:
            return ()
        relative = sign * _MOST * np.tanh(_TYPICAL / _MOST * strength)
        return (TimeBaseError(float(relative), float(sway), float(phase)),)

    return at
