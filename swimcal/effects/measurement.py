"""Effects of camera, markers and tracker: they change what is seen of a swim, not the swim."""

from itertools import pairwise
from typing import ClassVar

import numpy as np

from swimcal.effects.effect import Drive, Effect, Observation, Parameter
from swimcal.robot import RobotSpec, load_robot
from swimcal.session_file import HEAD_MARKERS


class CameraEffect(Effect):
    """Effect of camera, markers or tracker; every kind of trial shows it."""

    family = "measurement"
    stage = "camera"
    seen_in = frozenset({"free_decay", "dry", "swim"})


class HeadFrameMisalignment(CameraEffect):
    """The two markers that make the head frame are found to one side of where they are.

    By `across` where a box has found a spot that turns with the head, by `in_picture` where it keeps the offset that it
    was placed with in the first frame, whichever way the head turns.
    """

    name = "head_frame_misalignment"
    physics = "The line from nose to neck, which every marker is turned by, makes an angle with the head's axis."
    source = "Geometry of the published normaliser; boxes are placed by hand."
    parameters = tuple(
        Parameter(name, "m", -0.03, 0.03, 0.003)
        for name in ("nose_across", "neck_across", "nose_in_picture", "neck_in_picture")
    )

    def observe(self, seen: Observation, values: np.ndarray) -> np.ndarray:
        """Shift nose and neck across the body: as it is in each frame, and as it was in the first."""
        head = [seen.names.index("nose"), seen.names.index("neck")]
        found, across = seen.marker_m.copy(), seen.axes[:, head, 1]  # (f, 2, 2)
        found[:, head] += values[:2, None] * across + values[2:, None] * across[0]
        return found


class ScaleError(CameraEffect):
    """Nose and neck are found further apart than they are; all else is scaled by them.

    By the share `relative` where a box has found a spot that turns with the head, by `in_picture` where it keeps the
    offset that it was placed with in the first frame, whichever way the head turns.
    """

    name = "scale_error"
    physics = "Metres in a picture are pixels times a scale; a wrong distance between nose and neck scales everything."
    source = "Pinhole camera; the published normaliser takes the scale from two boxes placed by hand."
    parameters = (Parameter("relative", "1", -0.3, 0.3, 0.02), Parameter("in_picture", "1", -0.3, 0.3, 0.02))

    def observe(self, seen: Observation, values: np.ndarray) -> np.ndarray:
        """Move the neck further back."""
        nose, neck = seen.names.index("nose"), seen.names.index("neck")
        found = seen.marker_m.copy()
        line = seen.marker_m[:, neck] - seen.marker_m[:, nose]
        found[:, neck] += values[0] * line + values[1] * line[0]
        return found


class CameraParallax(CameraEffect):
    """Markers at another height than nose and neck are seen nearer to the picture's edge, or further from it.

    How high nose and neck are is the least certain: nobody measures it, and a fish that is trimmed nose down has them
    at heights of their own. Hence either may be nearer to the camera than described, by a share of its height.
    """

    name = "camera_parallax"
    physics = "A point z above the plane of the scale is magnified by 1 / (1 - z / H) for a camera at height H over it."
    source = "Pinhole camera (Hartley and Zisserman, Multiple View Geometry, section 6.1)."
    parameters = (
        Parameter("inverse_height", "1/m", 0.0, 2.0, 0.4),
        Parameter("nose_nearer", "1", -0.1, 0.1, 0.01),
        Parameter("neck_nearer", "1", -0.1, 0.1, 0.01),
    )

    def observe(self, seen: Observation, values: np.ndarray) -> np.ndarray:
        """Magnify the markers' distances from the point under the camera."""
        nearness = seen.above_m * values[0]
        nearness[[seen.names.index("nose"), seen.names.index("neck")]] += values[1:]
        return np.asarray(seen.marker_m + (nearness / (1 - nearness))[:, None] * (seen.marker_m - seen.view.axis_m))


class LensDistortion(CameraEffect):
    """The scale changes from the middle of the picture to its edge."""

    name = "lens_distortion"
    physics = "A radius r in the picture is drawn at r (1 + k1 r^2); r = 1 at the lower edge."
    source = "Brown, Photogrammetric Engineering 32 (1966): the first radial term."
    parameters = (Parameter("k1", "1", -0.3, 0.3, 0.03),)

    def observe(self, seen: Observation, values: np.ndarray) -> np.ndarray:
        """Stretch the markers' distances from the point under the camera."""
        off = seen.marker_m - seen.view.axis_m
        square = (off**2).sum(axis=-1, keepdims=True) / seen.view.half_height_m**2
        return np.asarray(seen.marker_m + values[0] * square * off)


class TimeBaseError(Effect):
    """A second on the camera's clock lasts longer by the share `relative`.

    The swim frequency is measured on that clock too, so a crank that no motor log shows is slower by as much.
    """

    name = "time_base_error"
    family = "measurement"
    stage = "drive"
    seen_in = frozenset({"free_decay", "dry", "swim"})
    physics = "Frames are further apart than their stamps say: speeds and frequencies are read too high."
    source = "A frame rate taken from the file's header or the camera's menu."
    parameters = (Parameter("relative", "1", -0.4, 0.4, 0.02),)

    def clock(self, time_s: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Return the true times (f,), s."""
        return np.asarray(time_s * (1 + values[0]))

    def drive(self, drive: Drive, values: np.ndarray) -> Drive:
        """Return the drive at the true frequency, where it was measured on the camera's clock."""
        if drive.turn is not None:
            return drive
        return drive._replace(frequency_hz=float(drive.frequency_hz / (1 + values[0])))

    def measured_hz(self, turned_hz: float, values: np.ndarray) -> float:
        """Return the frequency on the camera's clock, Hz."""
        return float(turned_hz * (1 + values[0]))


class RollingShutter(CameraEffect):
    """Markers lower in the picture are seen later."""

    name = "rolling_shutter"
    physics = "The lowest line is exposed one readout time after the highest: what moves is seen where it will be."
    source = "Meingast, Geyer and Sastry (2005), Geometric models of rolling-shutter cameras."
    parameters = (Parameter("readout", "s", 0.0, 0.04, 0.01),)

    def observe(self, seen: Observation, values: np.ndarray) -> np.ndarray:
        """Return each marker where it is when its line is read, to first order in the readout time."""
        lines = (seen.marker_m - seen.view.axis_m) @ seen.view.down / (2 * seen.view.half_height_m)  # (f, m)
        velocity = np.gradient(seen.marker_m, seen.time_s, axis=0)
        return np.asarray(seen.marker_m + values[0] * lines[..., None] * velocity)


class _MarkerShift(CameraEffect):
    """Effect on each marker but nose and neck, with a parameter along its link and one across, in `unit`."""

    unit: ClassVar[str]
    most: ClassVar[float]
    sd: ClassVar[float]

    def __init__(self, markers: tuple[str, ...]) -> None:
        self._markers = tuple(name for name in markers if name not in HEAD_MARKERS)
        self.parameters = tuple(
            Parameter(f"{marker}_{way}", self.unit, -self.most, self.most, self.sd)
            for marker in self._markers
            for way in ("along", "across")
        )

    def suited(self, robot: RobotSpec, markers: tuple[str, ...]) -> Effect:
        """Return the effect for these markers."""
        return type(self)(markers)

    def by_marker(self, seen: Observation, values: np.ndarray) -> np.ndarray:
        """Return the values of all markers (m, 2), 0 for those of nose and neck."""
        found = np.zeros((len(seen.names), 2))
        found[[seen.names.index(name) for name in self._markers]] = values.reshape(-1, 2)
        return found


class MarkerOffset(_MarkerShift):
    """Each marker but nose and neck is glued, or its box placed, off its place, along the body and across."""

    name = "marker_offset"
    physics = "A marker that rides on its link off its place is off by a constant vector in the link's frame."
    source = "Rigid-body kinematics; markers are glued and boxes placed by hand."
    unit, most, sd = "m", 0.05, 0.004

    def observe(self, seen: Observation, values: np.ndarray) -> np.ndarray:
        """Shift the markers with their links."""
        return np.asarray(seen.marker_m + np.einsum("mk,fmkd->fmd", self.by_marker(seen, values), seen.axes))


class TrackerDrift(_MarkerShift):
    """Boxes slide off their markers at a steady pace, along the body and across; those of nose and neck are held."""

    name = "tracker_drift"
    physics = "A template that is renewed from what was found last adds up its small errors: a drift in one direction."
    source = "Matthews, Ishikawa and Baker, The template update problem, IEEE PAMI 26 (2004)."
    unit, most, sd = "m/s", 0.01, 0.001

    def observe(self, seen: Observation, values: np.ndarray) -> np.ndarray:
        """Slide the markers further on their links from frame to frame."""
        pace = self.by_marker(seen, values)
        return np.asarray(seen.marker_m + np.einsum("f,mk,fmkd->fmd", seen.time_s - seen.time_s[0], pace, seen.axes))


class MarkerSwap(CameraEffect):
    """Two neighbours on the tail are exchanged for a share of the time; what is seen is the mean over such times."""

    name = "marker_swap"
    physics = "Two markers of one look that pass close by leave a tracker with the names exchanged."
    source = "Identity switches in multi-object tracking (Milan et al. 2016, MOT16)."

    def __init__(self, tail: tuple[str, ...]) -> None:
        self._pairs = tuple(pairwise(tail))
        self.parameters = tuple(Parameter(f"{front}_{rear}", "1", 0.0, 1.0, 0.1) for front, rear in self._pairs)

    def suited(self, robot: RobotSpec, markers: tuple[str, ...]) -> Effect:
        """Return the effect for these markers."""
        return MarkerSwap(_on_tail(robot, markers))

    def observe(self, seen: Observation, values: np.ndarray) -> np.ndarray:
        """Move each marker towards its neighbours by the share of the time."""
        found = seen.marker_m.copy()
        for (front, rear), share in zip(self._pairs, values, strict=True):
            i, j = seen.names.index(front), seen.names.index(rear)
            apart = share * (seen.marker_m[:, j] - seen.marker_m[:, i])
            found[:, i] += apart
            found[:, j] -= apart
        return found


def _on_tail(robot: RobotSpec, markers: tuple[str, ...]) -> tuple[str, ...]:
    """Return the markers on the tail, from head to fin."""
    behind = [name for name in markers if robot.markers[name].body != "head"]
    return tuple(sorted(behind, key=lambda name: robot.markers[name].position_m[0]))


EFFECTS: tuple[Effect, ...] = (
    HeadFrameMisalignment(),
    ScaleError(),
    CameraParallax(),
    LensDistortion(),
    TimeBaseError(),
    RollingShutter(),
    MarkerOffset(tuple(load_robot().markers)),
    TrackerDrift(tuple(load_robot().markers)),
    MarkerSwap(_on_tail(load_robot(), tuple(load_robot().markers))),
)
