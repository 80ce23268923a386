"""A camera so low that markers above or below the head's appear elsewhere."""

import numpy as np

from swimmer.effects.effect import Effect, Parameter
from swimmer.effects.seen import Seen


class CameraParallax(Effect):
    """Markers at another height than nose and neck are seen nearer to the picture's edge, or further from it."""

    name = "camera_parallax"
    family = "measurement"
    stage = "camera"
    physics = "A point z above the plane of the scale is magnified by 1 / (1 - z / H) for a camera at height H over it."
    source = "Pinhole camera (Hartley and Zisserman, Multiple View Geometry, section 6.1)."
    seen_in = frozenset({"free_decay", "dry", "swim"})
    parameters = (Parameter("inverse_height", "1/m", 0.0, 2.0, 0.4),)

    def observe(self, seen: Seen, values: np.ndarray) -> np.ndarray:
        """About the point under the camera."""
        nearness = seen.above_m * values[0]
        return np.asarray(seen.marker_m + (nearness / (1 - nearness))[:, None] * (seen.marker_m - seen.view.axis_m))


EFFECT = CameraParallax()
