"""A sensor that is read line by line."""

import numpy as np

from swimmer.effects.effect import Effect, Parameter
from swimmer.effects.seen import Seen


class RollingShutter(Effect):
    """Markers lower in the picture are seen later."""

    name = "rolling_shutter"
    family = "measurement"
    stage = "camera"
    physics = "The lowest line is exposed one readout time after the highest: what moves is seen where it will be."
    source = "Meingast, Geyer and Sastry (2005), Geometric models of rolling-shutter cameras."
    seen_in = frozenset({"free_decay", "dry", "swim"})
    parameters = (Parameter("readout", "s", 0.0, 0.04, 0.01),)

    def observe(self, seen: Seen, values: np.ndarray) -> np.ndarray:
        """Each marker where it is when its line is read, to first order in the readout time."""
        lines = (seen.marker_m - seen.view.axis_m) @ seen.view.down / (2 * seen.view.half_height_m)  # (f, m)
        velocity = np.gradient(seen.marker_m, seen.time_s, axis=0)
        return np.asarray(seen.marker_m + values[0] * lines[..., None] * velocity)


EFFECT = RollingShutter()
