"""A recorder that repeats and drops frames while the time stamps run on."""

from dataclasses import dataclass

import numpy as np

from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength

_RATE_HZ, _MEAN_FRAMES = 0.4, 1.5


@dataclass(frozen=True)
class TimingGlitch(Mechanism):
    """Now and then the picture freezes for some frames, or skips some; all that follows is late, or early.

    Attributes:
        rate_hz: of glitches.
        seed: of when they come and how long they last, others in trials of another length; those at a low rate come at
            a higher one too.
    """

    rate_hz: float
    seed: int

    def expose(self, time_s: np.ndarray) -> np.ndarray:
        """Times as many frames off as have been lost or gained so far."""
        random, frames = np.random.default_rng([self.seed, len(time_s)]), len(time_s)
        step = np.diff(time_s, prepend=time_s[:1])
        rare, skips = random.random(frames), random.random(frames) < 0.5
        lasts = random.geometric(1 / _MEAN_FRAMES, frames)
        struck = np.flatnonzero(rare < -np.expm1(-self.rate_hz * step))
        shown = step.copy()
        for k in struck[skips[struck]]:
            shown[k] += lasts[k] * step[k]
        for k in struck[~skips[struck]]:
            shown[k : k + lasts[k]] = 0.0
        return time_s + np.cumsum(shown - step)


def drawn(random: np.random.Generator) -> AtStrength:
    """A glitch in 2.5 s at strength 1, of one or two frames; as often again with every further 1."""
    seed = int(random.integers(2**31))
    return lambda strength: (TimingGlitch(_RATE_HZ * strength, seed),) if strength else ()
