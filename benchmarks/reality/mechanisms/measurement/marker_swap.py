"""Neighbouring markers whose names a tracker exchanges now and then."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reality.camera import Picture
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength
from benchmarks.reality.mechanisms.wear import Wearing
from session import FISHSIM_MARKERS

_TYPICAL, _MOST = 0.1, 0.9
_APART_S = 0.7  # mean time from one exchange to the next


@dataclass(frozen=True)
class MarkerSwap(Wearing):
    """Two tracks truly exchange their markers, in bursts that begin at random and are longer the larger their share.

    Identity switches: Milan et al. (2016), MOT16. The bursts go on from one trial to the next, by the time in use.

    Attributes:
        front, rear: names of the two.
        share: of the time.
        seed: of when the bursts begin.
    """

    front: str
    rear: str
    share: float
    seed: int

    def picture(self, picture: Picture) -> Picture:
        """Exchanged in some frames, untouched in the others."""
        front, rear = picture.names.index(self.front), picture.names.index(self.rear)
        frames = self._exchanged(picture.time_s)
        position_px = picture.position_px.copy()
        position_px[frames, front] = picture.position_px[frames, rear]
        position_px[frames, rear] = picture.position_px[frames, front]
        return replace(picture, position_px=position_px)

    def _exchanged(self, time_s: np.ndarray) -> np.ndarray:
        """(f,) whether: in the last `share` of each stretch from one recovery to the next."""
        random = np.random.default_rng(self.seed)
        in_use_s = self.before_s + time_s
        ends = np.cumsum(random.exponential(_APART_S, int(4 * (in_use_s[-1] / _APART_S + 4))))
        stretch = np.searchsorted(ends, in_use_s, side="right")
        begins = np.append(0.0, ends)[stretch]
        return np.asarray(ends[stretch] - in_use_s <= self.share * (ends[stretch] - begins))


def drawn(random: np.random.Generator) -> AtStrength:
    """Draws one pair of neighbours on the tail, or two; their share saturates at 90 % of the time."""
    tail = FISHSIM_MARKERS[FISHSIM_MARKERS.index("tail_1") :]
    first = random.permutation(len(tail) - 1)[: random.integers(1, 3)]
    seeds = random.integers(2**31, size=len(first))

    def at(strength: float) -> tuple[Mechanism, ...]:
        if strength == 0:
            return ()
        share = float(-_MOST * np.expm1(-_TYPICAL / _MOST * strength))
        return tuple(MarkerSwap(tail[i], tail[i + 1], share, int(seed)) for i, seed in zip(first, seeds, strict=True))

    return at
