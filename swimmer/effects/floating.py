"""Effects of a body that floats: it rolls and pitches, and raised markers swing with it."""

from dataclasses import dataclass

import numpy as np

from swimmer.effects.effect import Effect, Observation, Parameter
from swimmer.robot import RobotSpec

ROLL_HZ = 2.0
"""Natural frequency of a small float in roll."""

PITCH_HZ = 1.6
"""Natural frequency of a small float in pitch."""

DAMPING = 0.2
"""Damping ratio of a small float in roll and pitch."""
_HARMONICS = np.arange(1, 4)


def swing(driven: np.ndarray, beat_rad: np.ndarray, time_s: np.ndarray, natural_hz: float) -> np.ndarray:
    """Return the lasting answer x (f,) of x'' + 2 z w x' + w^2 x = w^2 d to a drive d (f,); w = 2 pi natural_hz.

    Args:
        driven: (f,) the drive d, of which the first three harmonics of the beat count.
        beat_rad: (f,) angle of the crank.
        time_s: (f,) s.
        natural_hz: natural frequency of the oscillator.
    """
    turning = np.exp(1j * np.outer(beat_rad, _HARMONICS))  # (f, 3)
    columns = np.column_stack([np.ones(len(time_s)), turning.real, turning.imag])
    cosine, sine = np.linalg.lstsq(columns, driven, rcond=None)[0][1:].reshape(2, -1)
    faster = (
        _HARMONICS * np.polyfit(time_s, beat_rad, 1)[0] / (2 * np.pi * natural_hz)
    )  # ratio to the natural frequency
    answer = (cosine - 1j * sine) / (1 - faster**2 + 2j * DAMPING * faster)
    return np.asarray((turning @ answer).real)


class FloatingEffect(Effect):
    """Effect of a body that floats."""

    family = "fluid"
    stage = "camera"
    seen_in = frozenset({"swim"})


class SurfaceMotion(FloatingEffect):
    """Raised markers swing over the water line, at which nose and neck are: sideways with roll, lengthwise with pitch.

    Roll and pitch are what a damped float does when the head's acceleration shakes it, across and along: in proportion
    to it far below the natural frequency, late near it. Heave moves nothing in a picture taken from straight above and
    far, so there is none.
    """

    name = "surface_motion"
    physics = (
        "A shaken float rolls and pitches; a marker z above the water line moves by -z roll to the right, z pitch aft."
    )
    source = "Driven damped oscillator; kinematics of a floating body, small angles."
    parameters = (
        Parameter("roll", "rad s^2/m", -0.3, 0.3, 0.02),
        Parameter("pitch", "rad s^2/m", -0.6, 0.6, 0.06),
        Parameter("pitch_over_height", "rad s^2/m^2", -0.3, 0.3, 0.025),
    )

    def observe(self, seen: Observation, values: np.ndarray) -> np.ndarray:
        """Swing the markers about the axes of the head, as its upright hinges make the tail roll and pitch along."""
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
        nearer = -values[2] * pitch[:, None] * behind  # relative to the camera's height
        swung = seen.marker_m + seen.above_m[:, None] * lean[:, None]
        return np.asarray(swung + nearer[..., None] * (seen.marker_m - seen.view.axis_m))


NATURAL_ROLL_HZ = 0.6
"""Natural roll frequency of a hull with little righting moment; `natural` is the logarithm of the ratio to it."""


@dataclass(frozen=True, eq=False)
class RollingHull:
    """A hull that rolls about a long axis.

    Attributes:
        behind_neck_m: distance from the neck to the centre of mass, m.
        height_m: (m,) heights of the markers, m.
        neck: number of the neck among the markers.
    """

    behind_neck_m: float
    height_m: np.ndarray
    neck: int

    @classmethod
    def of(cls, robot: RobotSpec, markers: tuple[str, ...]) -> "RollingHull":
        """Build the hull of a robot with these markers."""
        parts = robot.head.part
        centre_m = sum(part.mass_kg * part.centre_m[0] for part in parts) / sum(part.mass_kg for part in parts)
        places = robot.marker_positions_m(markers)
        neck = markers.index("neck")
        return cls(float(centre_m - places[neck, 0]), places[:, 2], neck)

    def shift_m(
        self, time_s: np.ndarray, marker_m: np.ndarray, axes: np.ndarray, crank_rad: np.ndarray, natural_hz: float
    ) -> np.ndarray:
        """Return the swing of the markers (f, m, 2), m, by a unit roll.

        The roll is 1 rad for each metre of sway far above the natural frequency.

        Args:
            time_s: (f,) s.
            marker_m: (f, m, 2) without roll, m.
            axes: (f, m, 2, 2) axes of the links that carry them, backward and to the right.
            crank_rad: (f,) angle of the crank.
            natural_hz: natural frequency of the roll.
        """
        backward, right = axes[:, self.neck, 0], axes[:, self.neck, 1]  # (f, 2) each
        centre_m = marker_m[:, self.neck] + self.behind_neck_m * backward
        acceleration = np.gradient(np.gradient(centre_m, time_s, axis=0), time_s, axis=0)
        driven = (acceleration * right).sum(axis=1) / (2 * np.pi * natural_hz) ** 2
        roll_rad = swing(driven, crank_rad, time_s, natural_hz)
        return np.asarray((roll_rad[:, None] * self.height_m)[..., None] * right[:, None])


class HullRoll(FloatingEffect):
    """The whole fish rolls, most where it beats near the natural frequency of its roll.

    The water pushes it sideways below its centre of mass; a small righting moment, and a damping ratio of `DAMPING`,
    hold the roll. Markers on head and tail swing alike, by their heights over the axis. So the wave seen from above
    changes with the frequency although that in the water does not. The roll does not react on the planar motion.
    """

    name = "hull_roll"
    physics = (
        "roll'' + 2 z w roll' + w^2 roll = g a, a the head's acceleration sideways, g its mass times the height of its "
        "centre over the roll axis, by its moment of inertia."
    )
    source = "Damped oscillator of one degree of freedom: Lewandowski, The Dynamics of Marine Craft (2004), chapter 6."
    parameters = (
        Parameter("roll_per_sway", "1/m", -80.0, 80.0, 20.0),
        Parameter("natural", "1", -1.0, 1.0, 0.3),
    )

    def __init__(self, hull: RollingHull | None = None) -> None:
        self._hull = hull

    def suited(self, robot: RobotSpec, markers: tuple[str, ...]) -> Effect:
        """Return the effect with the marker heights of this robot."""
        return HullRoll(RollingHull.of(robot, markers))

    def observe(self, seen: Observation, values: np.ndarray) -> np.ndarray:
        """Swing the markers to either side."""
        if self._hull is None or not values[0] or not np.isfinite(seen.marker_m).all():
            return seen.marker_m
        natural_hz = NATURAL_ROLL_HZ * float(np.exp(values[1]))
        swung = self._hull.shift_m(seen.time_s, seen.marker_m, seen.axes, seen.crank_rad, natural_hz)
        return np.asarray(seen.marker_m + values[0] * swung)


EFFECTS: tuple[Effect, ...] = (SurfaceMotion(), HullRoll())
