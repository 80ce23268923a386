"""A body that rolls and pitches at the surface, where the planar twin floats upright."""

import numpy as np

from swimmer.effects.effect import Effect, Parameter
from swimmer.effects.seen import Seen

_MOST_RAD, _SD_RAD = 0.3, 0.05


class SurfaceMotion(Effect):
    """Raised markers swing over the water line, at which nose and neck are: sideways with roll, lengthwise with pitch.

    Roll comes once a beat, with the tail's side force; pitch twice, with its thrust. Heave moves nothing in a picture
    taken from straight above and far, so there is none.
    """

    name = "surface_motion"
    family = "fluid"
    stage = "camera"
    physics = "A marker z above the water line moves by -z roll to the right and by z pitch backward (small angles)."
    source = "Kinematics of a floating body; the published fish is held upright by 10 N m/rad only."
    seen_in = frozenset({"swim"})
    parameters = (
        Parameter("roll_cosine", "rad", -_MOST_RAD, _MOST_RAD, _SD_RAD),
        Parameter("roll_sine", "rad", -_MOST_RAD, _MOST_RAD, _SD_RAD),
        Parameter("pitch_cosine", "rad", -_MOST_RAD, _MOST_RAD, _SD_RAD),
        Parameter("pitch_sine", "rad", -_MOST_RAD, _MOST_RAD, _SD_RAD),
    )

    def observe(self, seen: Seen, values: np.ndarray) -> np.ndarray:
        """About the axes of the head: the tail's hinges are upright, so it rolls and pitches along."""
        beat = seen.crank_rad[:, None]
        roll = values[0] * np.cos(beat) + values[1] * np.sin(beat)
        pitch = values[2] * np.cos(2 * beat) + values[3] * np.sin(2 * beat)
        backward, right = np.moveaxis(seen.axes[:, seen.names.index("nose")], 1, 0)  # (f, 2)
        lean = pitch * backward - roll * right
        return np.asarray(seen.marker_m + seen.above_m[:, None] * lean[:, None])


EFFECT = SurfaceMotion()
