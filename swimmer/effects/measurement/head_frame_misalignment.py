"""Boxes of nose and neck beside their markers: the head frame is turned against the head."""

import numpy as np

from swimmer.effects.effect import Effect, Parameter
from swimmer.effects.seen import Seen

_MOST_M, _SD_M = 0.03, 0.003


class HeadFrameMisalignment(Effect):
    """The two markers that make the head frame are found to one side of where they are."""

    name = "head_frame_misalignment"
    family = "measurement"
    stage = "camera"
    physics = "The line from nose to neck, which every marker is turned by, makes an angle with the head's axis."
    source = "Geometry of the published normaliser; boxes are placed by hand."
    seen_in = frozenset({"free_decay", "dry", "swim"})
    parameters = (
        Parameter("nose_across", "m", -_MOST_M, _MOST_M, _SD_M),
        Parameter("neck_across", "m", -_MOST_M, _MOST_M, _SD_M),
    )

    def observe(self, seen: Seen, values: np.ndarray) -> np.ndarray:
        """Both shifted across the body."""
        shift = np.zeros(len(seen.names))
        shift[[seen.names.index("nose"), seen.names.index("neck")]] = values
        return np.asarray(seen.marker_m + shift[:, None] * seen.axes[:, :, 1])


EFFECT = HeadFrameMisalignment()
