"""A tracker that slides off its markers."""

import numpy as np

from swimmer.effects.effect import Effect, Parameter
from swimmer.effects.measurement.of_markers import others
from swimmer.effects.seen import Seen
from swimmer.robot import RobotSpec, load_robot


class TrackerDrift(Effect):
    """Boxes slide along the body at a steady pace, each at its own; those of nose and neck are held."""

    name = "tracker_drift"
    family = "measurement"
    stage = "camera"
    physics = "A template that is renewed from what was found last adds up its small errors: a drift in one direction."
    source = "Matthews, Ishikawa and Baker, The template update problem, IEEE PAMI 26 (2004)."
    seen_in = frozenset({"free_decay", "dry", "swim"})

    def __init__(self, markers: tuple[str, ...]) -> None:
        self._markers = others(markers)
        self.parameters = tuple(Parameter(marker, "m/s", -0.01, 0.01, 0.001) for marker in self._markers)

    def suited(self, robot: RobotSpec, markers: tuple[str, ...]) -> Effect:
        """For these markers."""
        return TrackerDrift(markers)

    def observe(self, seen: Seen, values: np.ndarray) -> np.ndarray:
        """Further along the body from frame to frame."""
        pace = np.zeros(len(seen.names))
        pace[[seen.names.index(name) for name in self._markers]] = values
        slid_m = np.multiply.outer(seen.time_s - seen.time_s[0], pace)  # (f, m)
        return np.asarray(seen.marker_m + slid_m[..., None] * seen.axes[:, :, 0])


EFFECT = TrackerDrift(tuple(load_robot().markers))
