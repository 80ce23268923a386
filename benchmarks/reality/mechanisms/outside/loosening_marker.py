"""A marker that comes loose."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reality.camera import Sight
from benchmarks.reality.mechanisms import AtStrength
from benchmarks.reality.mechanisms.wear import Wearing

_SLIDE_M, _WOBBLE_M = 0.004, 0.003
_SLOW_M_S = 0.1


@dataclass(frozen=True)
class LooseningMarker(Wearing):
    """It slides tailwards out of its socket, ever more slowly, and lags in it when the tail sweeps sideways.

    Attributes:
        which: 0 to 1, of all markers but nose and neck.
        slide_m: in the end.
        slide_s: in which two thirds of it are done.
        wobble_m: most that it lags.
    """

    which: float
    slide_m: float
    slide_s: float
    wobble_m: float

    def place(self, sight: Sight) -> Sight:
        """Moves the one marker."""
        loose = [i for i, name in enumerate(sight.names) if name not in ("nose", "neck")]
        if not loose:
            return sight
        marker = loose[int(self.which * len(loose))]
        time_s, frame, seen = np.unique(sight.time_s.round(6), return_index=True, return_inverse=True)
        place_m, axis = sight.marker_m[:, marker], sight.axis[:, marker]
        sweep = (np.gradient(place_m[frame], time_s)[seen] * axis.conj()).imag
        slid = -self.slide_m * np.expm1(-(self.before_s + sight.time_s) / self.slide_s)
        moved = sight.marker_m.copy()
        moved[:, marker] += (slid - 1j * self.wobble_m * np.tanh(sweep / _SLOW_M_S)) * axis
        return replace(sight, marker_m=moved)


def drawn(random: np.random.Generator) -> AtStrength:
    """Any but nose and neck; mixes 4 mm of slide with 3 mm of wobble at strength 1; linear."""
    which, mix, slide_s = random.random(), random.random(), random.uniform(3.0, 30.0)
    return lambda strength: (
        (LooseningMarker(which, (1 - mix) * _SLIDE_M * strength, slide_s, mix * _WOBBLE_M * strength),)
        if strength
        else ()
    )
