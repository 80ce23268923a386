"""A length scale that is wrong because the boxes it is taken from are too far apart, or too close."""

import numpy as np

from swimmer.effects.effect import Effect, Parameter
from swimmer.effects.seen import Seen


class ScaleError(Effect):
    """Nose and neck are found further apart than they are, by the share `relative`; all else is scaled by them."""

    name = "scale_error"
    family = "measurement"
    stage = "camera"
    physics = "Metres in a picture are pixels times a scale; a wrong distance between nose and neck scales everything."
    source = "Pinhole camera; the published normaliser takes the scale from two boxes placed by hand."
    seen_in = frozenset({"free_decay", "dry", "swim"})
    parameters = (Parameter("relative", "1", -0.3, 0.3, 0.02),)

    def observe(self, seen: Seen, values: np.ndarray) -> np.ndarray:
        """The neck further back."""
        nose, neck = seen.names.index("nose"), seen.names.index("neck")
        found = seen.marker_m.copy()
        found[:, neck] += values[0] * (seen.marker_m[:, neck] - seen.marker_m[:, nose])
        return found


EFFECT = ScaleError()
