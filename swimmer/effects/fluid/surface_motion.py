"""A body that rolls and pitches at the surface, where the planar twin floats upright."""

import numpy as np

from swimmer.effects.effect import Effect, Parameter
from swimmer.effects.seen import Seen

ROLL_HZ, PITCH_HZ, DAMPING = 2.0, 1.6, 0.2
"""Natural frequencies of a small float, and their damping ratio."""
_HARMONICS = np.arange(1, 4)


def swing(driven: np.ndarray, beat_rad: np.ndarray, time_s: np.ndarray, natural_hz: float) -> np.ndarray:
    """(f,) lasting answer x of x'' + 2 z w x' + w^2 x = w^2 d to a drive d (f,), beat by beat; w = 2 pi natural_hz.

    Args:
        driven: d, of which the first three harmonics count.
        beat_rad: (f,) angle of the crank.
        time_s: (f,).
        natural_hz: of the oscillator.
    """
    turning = np.exp(1j * np.outer(beat_rad, _HARMONICS))  # (f, 3)
    columns = np.column_stack([np.ones(len(time_s)), turning.real, turning.imag])
    cosine, sine = np.linalg.lstsq(columns, driven, rcond=None)[0][1:].reshape(2, -1)
    faster = _HARMONICS * np.polyfit(time_s, beat_rad, 1)[0] / (2 * np.pi * natural_hz)  # over the natural frequency
    answer = (cosine - 1j * sine) / (1 - faster**2 + 2j * DAMPING * faster)
    return np.asarray((turning @ answer).real)


class SurfaceMotion(Effect):
    """Raised markers swing over the water line, at which nose and neck are: sideways with roll, lengthwise with pitch.

    Roll and pitch are what a damped float does when the head's acceleration shakes it, across and along: in proportion
    to it far below the natural frequency, late near it. Heave moves nothing in a picture taken from straight above and
    far, so there is none.
    """

    name = "surface_motion"
    family = "fluid"
    stage = "camera"
    physics = (
        "A shaken float rolls and pitches; a marker z above the water line moves by -z roll to the right, z pitch aft."
    )
    source = "Driven damped oscillator; kinematics of a floating body, small angles."
    seen_in = frozenset({"swim"})
    parameters = (
        Parameter("roll", "rad s^2/m", -0.3, 0.3, 0.02),
        Parameter("pitch", "rad s^2/m", -0.6, 0.6, 0.06),
        Parameter("pitch_over_height", "rad s^2/m^2", -0.3, 0.3, 0.025),
    )

    def observe(self, seen: Seen, values: np.ndarray) -> np.ndarray:
        """About the axes of the head: the tail's hinges are upright, so it rolls and pitches along."""
        nose = seen.names.index("nose")
        if not values.any() or not np.isfinite(seen.marker_m).all():
            return seen.marker_m
        axes = seen.axes[:, nose]  # (f, 2, 2): backward, right
        velocity = np.gradient(seen.marker_m[:, nose], seen.time_s, axis=0)
        shaken = np.einsum("fkd,fd->fk", axes, np.gradient(velocity, seen.time_s, axis=0))  # m/s^2
        pitch, roll = (
            swing(value * shaken[:, k], seen.crank_rad, seen.time_s, hz)
            for k, (value, hz) in enumerate(((1.0, PITCH_HZ), (values[0], ROLL_HZ)))
        )
        lean = values[1] * pitch[:, None] * axes[:, 0] - roll[:, None] * axes[:, 1]
        behind = np.einsum("fmd,fd->fm", seen.marker_m - seen.marker_m[:, [seen.names.index("neck")]], axes[:, 0])
        nearer = -values[2] * pitch[:, None] * behind  # over the camera's height
        swung = seen.marker_m + seen.above_m[:, None] * lean[:, None]
        return np.asarray(swung + nearer[..., None] * (seen.marker_m - seen.view.axis_m))


EFFECT = SurfaceMotion()
