"""Boxes of nose and neck beside their markers: the head frame is turned against the head."""

import numpy as np

from swimmer.effects.effect import Effect, Parameter
from swimmer.effects.seen import Seen

_MOST_M, _SD_M = 0.03, 0.003


class HeadFrameMisalignment(Effect):
    """The two markers that make the head frame are found to one side of where they are.

    By `across` where a box has found a spot that turns with the head, by `in_picture` where it keeps the offset that it
    was placed with in the first frame, whichever way the head turns.
    """

    name = "head_frame_misalignment"
    family = "measurement"
    stage = "camera"
    physics = "The line from nose to neck, which every marker is turned by, makes an angle with the head's axis."
    source = "Geometry of the published normaliser; boxes are placed by hand."
    seen_in = frozenset({"free_decay", "dry", "swim"})
    parameters = (
        Parameter("nose_across", "m", -_MOST_M, _MOST_M, _SD_M),
        Parameter("neck_across", "m", -_MOST_M, _MOST_M, _SD_M),
        Parameter("nose_in_picture", "m", -_MOST_M, _MOST_M, _SD_M),
        Parameter("neck_in_picture", "m", -_MOST_M, _MOST_M, _SD_M),
    )

    def observe(self, seen: Seen, values: np.ndarray) -> np.ndarray:
        """Both shifted across the body: as it is in each frame, and as it was in the first."""
        head = [seen.names.index("nose"), seen.names.index("neck")]
        found, across = seen.marker_m.copy(), seen.axes[:, head, 1]  # (f, 2, 2)
        found[:, head] += values[:2, None] * across + values[2:, None] * across[0]
        return found


EFFECT = HeadFrameMisalignment()
