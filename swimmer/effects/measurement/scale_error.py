"""A length scale that is wrong because the boxes it is taken from are too far apart, or too close."""

import numpy as np

from swimmer.effects.effect import Effect, Parameter
from swimmer.effects.seen import Seen


class ScaleError(Effect):
    """Nose and neck are found further apart than they are; all else is scaled by them.

    By the share `relative` where a box has found a spot that turns with the head, by `in_picture` where it keeps the
    offset that it was placed with in the first frame, whichever way the head turns.
    """

    name = "scale_error"
    family = "measurement"
    stage = "camera"
    physics = "Metres in a picture are pixels times a scale; a wrong distance between nose and neck scales everything."
    source = "Pinhole camera; the published normaliser takes the scale from two boxes placed by hand."
    seen_in = frozenset({"free_decay", "dry", "swim"})
    parameters = (Parameter("relative", "1", -0.3, 0.3, 0.02), Parameter("in_picture", "1", -0.3, 0.3, 0.02))

    def observe(self, seen: Seen, values: np.ndarray) -> np.ndarray:
        """The neck further back."""
        nose, neck = seen.names.index("nose"), seen.names.index("neck")
        found = seen.marker_m.copy()
        line = seen.marker_m[:, neck] - seen.marker_m[:, nose]
        found[:, neck] += values[0] * line + values[1] * line[0]
        return found


EFFECT = ScaleError()
