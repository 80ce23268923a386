"""Neighbouring markers that a tracker takes for each other now and then."""

from itertools import pairwise

import numpy as np

from swimmer.effects.effect import Effect, Parameter
from swimmer.effects.measurement.of_markers import on_tail
from swimmer.effects.seen import Seen
from swimmer.robot import RobotSpec, load_robot


class MarkerSwap(Effect):
    """For a share of the time two neighbours on the tail are exchanged; what is seen is the mean over such times."""

    name = "marker_swap"
    family = "measurement"
    stage = "camera"
    physics = "Two markers of one look that pass close by leave a tracker with the names exchanged."
    source = "Identity switches in multi-object tracking (Milan et al. 2016, MOT16)."
    seen_in = frozenset({"free_decay", "dry", "swim"})

    def __init__(self, tail: tuple[str, ...]) -> None:
        self._pairs = tuple(pairwise(tail))
        self.parameters = tuple(Parameter(f"{front}_{rear}", "1", 0.0, 1.0, 0.1) for front, rear in self._pairs)

    def suited(self, robot: RobotSpec, markers: tuple[str, ...]) -> Effect:
        """For these markers."""
        return MarkerSwap(on_tail(robot, markers))

    def observe(self, seen: Seen, values: np.ndarray) -> np.ndarray:
        """Each marker drawn towards its neighbours by the share of the time."""
        found = seen.marker_m.copy()
        for (front, rear), share in zip(self._pairs, values, strict=True):
            i, j = seen.names.index(front), seen.names.index(rear)
            apart = share * (seen.marker_m[:, j] - seen.marker_m[:, i])
            found[:, i] += apart
            found[:, j] -= apart
        return found


EFFECT = MarkerSwap(on_tail(load_robot(), tuple(load_robot().markers)))
