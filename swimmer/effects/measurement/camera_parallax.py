"""A camera so low that markers above or below the head's appear elsewhere."""

import numpy as np

from swimmer.effects.effect import Effect, Parameter
from swimmer.effects.seen import Seen

_MOST, _SD = 0.1, 0.01


class CameraParallax(Effect):
    """Markers at another height than nose and neck are seen nearer to the picture's edge, or further from it.

    How high nose and neck are is the least certain: nobody measures it, and a fish that is trimmed nose down has them
    at heights of their own. Hence either may be nearer to the camera than described, by a share of its height.
    """

    name = "camera_parallax"
    family = "measurement"
    stage = "camera"
    physics = "A point z above the plane of the scale is magnified by 1 / (1 - z / H) for a camera at height H over it."
    source = "Pinhole camera (Hartley and Zisserman, Multiple View Geometry, section 6.1)."
    seen_in = frozenset({"free_decay", "dry", "swim"})
    parameters = (
        Parameter("inverse_height", "1/m", 0.0, 2.0, 0.4),
        Parameter("nose_nearer", "1", -_MOST, _MOST, _SD),
        Parameter("neck_nearer", "1", -_MOST, _MOST, _SD),
    )

    def observe(self, seen: Seen, values: np.ndarray) -> np.ndarray:
        """About the point under the camera."""
        nearness = seen.above_m * values[0]
        nearness[[seen.names.index("nose"), seen.names.index("neck")]] += values[1:]
        return np.asarray(seen.marker_m + (nearness / (1 - nearness))[:, None] * (seen.marker_m - seen.view.axis_m))


EFFECT = CameraParallax()
