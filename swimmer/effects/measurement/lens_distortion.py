"""A lens that is not rectilinear."""

import numpy as np

from swimmer.effects.effect import Effect, Parameter
from swimmer.effects.seen import Seen


class LensDistortion(Effect):
    """The scale changes from the middle of the picture to its edge."""

    name = "lens_distortion"
    family = "measurement"
    stage = "camera"
    physics = "A radius r in the picture is drawn at r (1 + k1 r^2); r = 1 at the lower edge."
    source = "Brown, Photogrammetric Engineering 32 (1966): the first radial term."
    seen_in = frozenset({"free_decay", "dry", "swim"})
    parameters = (Parameter("k1", "1", -0.3, 0.3, 0.03),)

    def observe(self, seen: Seen, values: np.ndarray) -> np.ndarray:
        """About the point under the camera."""
        off = seen.marker_m - seen.view.axis_m
        square = (off**2).sum(axis=-1, keepdims=True) / seen.view.half_height_m**2
        return np.asarray(seen.marker_m + values[0] * square * off)


EFFECT = LensDistortion()
