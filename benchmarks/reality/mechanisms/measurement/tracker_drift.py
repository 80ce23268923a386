"""A tracker that slides off its markers."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reality.camera import Sight
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength
from benchmarks.reality.mechanisms.wear import Wearing
from session import FISHSIM_MARKERS

_TYPICAL_M_S = 0.001
_WALK_M = 0.0001  # in a second, at strength 1
_HELD_M = 0.04  # a box that slid this far holds on to something else


@dataclass(frozen=True)
class TrackerDrift(Wearing):
    """Each box slides along the body as a random walk with a trend, bounded by the size of a box.

    Matthews, Ishikawa and Baker (2004), The template update problem: small errors of a template that is renewed add up.
    The trend is a matter of the marker, the same in every trial; the walk is another at every time in use.

    Attributes:
        pace_m_s: by name of marker, tailwards.
        walk_m: by which the walk spreads in a second.
        seed: of the walk.
    """

    pace_m_s: tuple[tuple[str, float], ...]
    walk_m: float
    seed: int

    def place(self, sight: Sight) -> Sight:
        """Further along the link from frame to frame."""
        marker_m = sight.marker_m.copy()
        elapsed_s = sight.time_s - sight.time_s[0]
        steps_s = np.diff(sight.time_s)
        for number, (name, pace) in enumerate(self.pace_m_s):
            if name in sight.names:
                random = np.random.default_rng([self.seed, number, round(1000 * self.before_s)])
                walk = np.cumsum(self.walk_m * np.sqrt(steps_s) * random.standard_normal(len(steps_s)))
                slid = pace * elapsed_s + np.append(0.0, walk)
                i = sight.names.index(name)
                marker_m[:, i] += _HELD_M * np.tanh(slid / _HELD_M) * sight.axis[:, i]
        return replace(sight, marker_m=marker_m)


def drawn(random: np.random.Generator) -> AtStrength:
    """Draws which boxes slide, at what pace, and how they waver. Each saturates where it has slid by 4 cm."""
    others = [name for name in FISHSIM_MARKERS if name not in {"nose", "neck"}]
    sliding = random.choice(others, size=random.integers(1, len(others) + 1), replace=False)
    pace = random.standard_normal(len(sliding))
    seed = int(random.integers(2**31))

    def at(strength: float) -> tuple[Mechanism, ...]:
        if strength == 0:
            return ()
        paces = tuple((str(name), float(_TYPICAL_M_S * strength * by)) for name, by in zip(sliding, pace, strict=True))
        return (TrackerDrift(paces, _WALK_M * strength, seed),)

    return at
