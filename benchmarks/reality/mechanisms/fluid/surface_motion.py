"""A body that rolls and pitches at the surface."""

from dataclasses import dataclass, field, replace

import numpy as np

from benchmarks.reality.camera import Sight
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength
from swimmer.robot import RobotSpec, load_robot

_ROLL_PER_M, _PITCH_PER_M = 3.5, 6.0  # angular acceleration over the nose's, 1/m
_MOST_RAD = 0.4


@dataclass(frozen=True)
class SurfaceMotion(Mechanism):
    """Roll and pitch are damped oscillators, as of any floating body, driven by the nose's acceleration as it is seen.

    roll'' + 2 z w roll' + w^2 roll = g a, a the acceleration across the head; pitch alike with that along it. Before
    the film they are driven by its mirror image. Markers swing about an axis below them, and come nearer to the camera
    where the body pitches up; in a dry run the head stands still, and nothing swings.

    Attributes:
        roll_per_m, pitch_per_m: g.
        roll_hz, pitch_hz: w / 2 pi.
        damping: z.
        draught_m: of the axis below the nose's marker.
        robot: whose markers these are.
    """

    roll_per_m: float
    pitch_per_m: float
    roll_hz: float
    pitch_hz: float
    damping: float
    draught_m: float
    robot: RobotSpec = field(default_factory=load_robot)

    def place(self, sight: Sight) -> Sight:
        """Swings the markers."""
        place_m = self.robot.marker_positions_m(sight.names)
        nose = self.robot.markers["nose"]
        head = [self.robot.markers[name].body == "head" for name in sight.names].index(True)
        above = place_m[:, 2] - nose.position_m[2] + self.draught_m
        time_s, frame = np.unique(sight.time_s.round(6), return_index=True)  # a frame may be seen twice
        axis = sight.axis[frame, head]
        nose_m = sight.marker_m[frame, head] - (place_m[head, 0] - nose.position_m[0]) * axis
        pushed = np.gradient(np.gradient(nose_m, time_s), time_s) * axis.conj()
        roll, pitch = (
            np.interp(sight.time_s, time_s, _MOST_RAD * np.tanh(self._swing(time_s, driven, hz) / _MOST_RAD))
            for driven, hz in (
                (self.roll_per_m * pushed.imag, self.roll_hz),
                (self.pitch_per_m * pushed.real, self.pitch_hz),
            )
        )
        along = sight.axis[:, head]
        lean = (np.sin(pitch) - 1j * np.sin(roll)) * along
        astern = ((sight.marker_m - sight.marker_m[:, head : head + 1]) * along[:, None].conj()).real
        astern = astern + place_m[head, 0] - self.robot.head.fluid_centre_m[0]
        return replace(
            sight,
            marker_m=sight.marker_m + above * lean[:, None],
            height_m=sight.height_m - np.sin(pitch)[:, None] * astern,
        )

    def _swing(self, time_s: np.ndarray, driven: np.ndarray, hz: float) -> np.ndarray:
        """(f,) angle at times (f,), by Newmark's method of mean acceleration; from rest a film's length before."""
        frames = len(time_s)
        time_s = np.concatenate([2 * time_s[0] - time_s[:0:-1], time_s])
        driven = np.concatenate([driven[:0:-1], driven])
        damping, stiffness = 4 * np.pi * self.damping * hz, (2 * np.pi * hz) ** 2
        angle, rate, gain = np.zeros(len(time_s)), 0.0, 0.0
        for k, h in enumerate(np.diff(time_s), start=1):
            ahead, faster = angle[k - 1] + h * rate + h**2 / 4 * gain, rate + h / 2 * gain
            gain = (driven[k] - damping * faster - stiffness * ahead) / (1 + damping * h / 2 + stiffness * h**2 / 4)
            angle[k], rate = ahead + h**2 / 4 * gain, faster + h / 2 * gain
        return angle[-frames:]


def drawn(random: np.random.Generator) -> AtStrength:
    """Some 0.05 rad of either at 1 Hz at strength 1; saturates at 0.4 rad."""
    roll = _ROLL_PER_M * random.choice([-1.0, 1.0]) * random.uniform(0.7, 1.4)
    pitch = _PITCH_PER_M * random.choice([-1.0, 1.0]) * random.uniform(0.7, 1.4)
    roll_hz, pitch_hz = random.uniform(1.9, 2.1), random.uniform(1.5, 1.7)
    damping, draught = random.uniform(0.18, 0.22), random.uniform(0.0, 0.003)
    return lambda strength: (
        (SurfaceMotion(strength * roll, strength * pitch, roll_hz, pitch_hz, damping, draught),) if strength else ()
    )
