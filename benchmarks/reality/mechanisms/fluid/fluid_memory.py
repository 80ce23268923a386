"""Water that answers to a change of motion with a delay."""

from dataclasses import dataclass

import numpy as np

from benchmarks.reality.fluid import StripForces
from benchmarks.reality.instant import Instant
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength

_WAGNER = ((0.165, 0.0455), (0.335, 0.3))
"""Share held back and fading per semichord travelled: R. T. Jones, NACA report 681 (1940), of Wagner's function."""
_SEMICHORD_M = 0.0012


@dataclass(frozen=True)
class FluidMemory(Mechanism):
    """Wagner's indicial response of every strip's forces: half at once, the rest as the wake is left behind.

    One wake trails the whole fish: it fades with the way that the surface has travelled on the mean, so a fast fish
    forgets sooner than a slow one.

    Attributes:
        semichord_m: unit of that way.
    """

    semichord_m: float

    def start(self, now: Instant) -> np.ndarray:
        """(n, 6 s + 1) forces as each of the two wakes holds them, no motion having changed yet; a step, s."""
        return np.concatenate([_stacked(now.water)] * len(_WAGNER) + [np.zeros((len(now.time_s), 1))], axis=1)

    def advance(self, now: Instant, state: np.ndarray, step_s: float) -> np.ndarray:
        """What the wakes held gives way to the forces of now."""
        late = self._late(now, state, step_s)
        step = np.full((len(state), 1), step_s)
        return np.concatenate([np.tile(_stacked(now.water), len(_WAGNER)) - late, step], axis=1)

    def water(self, now: Instant, forces: StripForces, state: np.ndarray) -> StripForces:
        """Less what the wakes hold back, a step after they were left."""
        late = np.split(self._late(now, state, state[:, -1:]), len(_WAGNER), axis=1)
        held = np.asarray(sum(share * each for (share, _), each in zip(_WAGNER, late, strict=True)))
        along, across, torque = np.split(held, 3, axis=1)
        return StripForces(forces.along_n - along, forces.across_n - across, forces.torque_n_m - torque)

    def _late(self, now: Instant, state: np.ndarray, step_s: float | np.ndarray) -> np.ndarray:
        """(n, 6 s) forces less those in the wakes after a step; exact for forces and speeds that last."""
        area = now.layout.strips.half_height_m * now.layout.strips.length_m
        speed = np.hypot(now.flow.along_m_s, now.flow.across_m_s) @ area / area.sum()
        travelled = speed[:, None] * step_s / self.semichord_m
        held = _stacked(now.water).shape
        left = np.concatenate([np.broadcast_to(np.exp(-f * travelled), held) for _, f in _WAGNER], axis=1)
        return np.asarray(left * (np.tile(_stacked(now.water), len(_WAGNER)) - state[:, :-1]))


def _stacked(forces: StripForces) -> np.ndarray:
    return np.concatenate([forces.along_n, forces.across_n, forces.torque_n_m], axis=1)


def drawn(random: np.random.Generator) -> AtStrength:
    """The way is such that at 0.25 m/s and strength 1 as much comes late as with half of it 0.05 s late; linear."""
    semichord = _SEMICHORD_M * random.uniform(0.8, 1.25)
    return lambda strength: (FluidMemory(semichord * strength),) if strength else ()
