"""Markers that are not where the description of the robot has them."""

import numpy as np

from swimmer.effects.effect import Effect, Parameter
from swimmer.effects.measurement.of_markers import others
from swimmer.effects.seen import Seen
from swimmer.robot import RobotSpec, load_robot

_MOST_M, _SD_M = 0.05, 0.004


class MarkerOffset(Effect):
    """Each marker but nose and neck is glued, or its box placed, beside its place, along the body and across."""

    name = "marker_offset"
    family = "measurement"
    stage = "camera"
    physics = "A marker that rides on its link beside its place is off by a constant vector in the link's frame."
    source = "Rigid-body kinematics; markers are glued and boxes placed by hand."
    seen_in = frozenset({"free_decay", "dry", "swim"})

    def __init__(self, markers: tuple[str, ...]) -> None:
        self._markers = others(markers)
        self.parameters = tuple(
            Parameter(f"{marker}_{way}", "m", -_MOST_M, _MOST_M, _SD_M)
            for marker in self._markers
            for way in ("along", "across")
        )

    def suited(self, robot: RobotSpec, markers: tuple[str, ...]) -> Effect:
        """For these markers."""
        return MarkerOffset(markers)

    def observe(self, seen: Seen, values: np.ndarray) -> np.ndarray:
        """Shifted with their links."""
        shift = np.zeros((len(seen.names), 2))
        shift[[seen.names.index(name) for name in self._markers]] = values.reshape(-1, 2)
        return np.asarray(seen.marker_m + np.einsum("mk,fmkd->fmd", shift, seen.axes))


EFFECT = MarkerOffset(tuple(load_robot().markers))
