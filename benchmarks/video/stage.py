"""Places of the markers in every frame, before anything is painted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.video.camera import Optics
from benchmarks.video.motion import Motion, RobotPoints, twin_motion
from benchmarks.video.plan import ClipPlan
from swimcal.robot import RobotSpec

_FEWEST_MOMENTS = 3
_MOST_MOMENTS = 24


@dataclass(frozen=True, eq=False)
class Stage:
    """Markers of a clip of n frames."""

    motion: Motion  # motion of the robot
    camera: Optics  # camera that looks on
    time_s: np.ndarray  # (n,) middle of the exposure of the image's middle row, s
    position_px: np.ndarray  # (n, m, 2) place at which each marker would be seen in an instant, at `time_s`
    exposed_px: np.ndarray  # (n, s, m, 2) places at s moments, evenly over the exposure of its own row

    @property
    def shown_px(self) -> np.ndarray:
        """(n, m, 2) the middle of what the picture shows: the mean over the exposure of the marker's own row."""
        return self.exposed_px.mean(axis=1)


def staged(
    motion: Motion,
    robot: RobotSpec,
    markers: tuple[str, ...],
    camera: Optics,
    time_s: np.ndarray,
) -> Stage:
    """Look through a camera at a motion in its pool, at the times (n,) of the frames."""
    points = RobotPoints(robot, [robot.markers[name] for name in markers])
    position_px = camera.project(points(motion.at(time_s)))  # (n, m, 2)
    pace_px_s = (
        np.linalg.norm(np.diff(position_px, axis=0), axis=2) / np.diff(time_s)[:, None] if len(time_s) > 1 else 0
    )
    exposure_s = camera.exposure_s
    path_px = exposure_s * float(np.max(pace_px_s))
    moments = int(np.clip(np.ceil(path_px), _FEWEST_MOMENTS, _MOST_MOMENTS)) if exposure_s else 1
    within_s = exposure_s * ((np.arange(moments) + 0.5) / moments - 0.5)
    row_px = _find_rows_px(motion, points, camera, time_s, position_px[..., 1])
    seen_s = time_s[:, None, None] + within_s[:, None] + camera.delay_s(row_px)[:, None]  # (n, s, m)
    return Stage(motion, camera, time_s, position_px, _project_each(motion, points, camera, seen_s))


def stage_of(plan: ClipPlan) -> Stage:
    """Place the markers of a planned clip, the middle of whose swim is in the middle of the picture.

    Raises:
        swimcal.errors.SimulationDiverged: the planned motion is unstable.
    """
    swim, optics, robot, time_s = plan.swim, plan.optics, plan.swimmer, plan.time_s
    motion = twin_motion(robot, swim.frequency_hz, swim.pace * float(time_s[-1])).paced(swim.pace)
    if swim.drift_m_s is not None:
        forward, left = swim.drift_m_s
        motion = motion.steadied([-forward, -left])  # The way is in the robot's frame, nose along -x.
    turn = np.radians(swim.heading_deg - 180.0) - float(motion.at(np.zeros(1)).head[0, 2])
    motion = centred(motion.moved(turn, (0.0, 0.0)), robot, plan.markers, time_s)
    x, y = swim.off_centre_px
    motion = motion.moved(0.0, (x / optics.px_per_m, -y / optics.px_per_m))
    return staged(motion, robot, plan.markers, optics, time_s)


def centred(motion: Motion, robot: RobotSpec, markers: tuple[str, ...], time_s: np.ndarray) -> Motion:
    """Shift the motion so that the box around all places of its markers has its middle at the origin."""
    place = RobotPoints(robot, [robot.markers[name] for name in markers])(motion.at(time_s))[..., :2]
    low, high = place.min(axis=(0, 1)), place.max(axis=(0, 1))
    return motion.moved(0.0, -(low + high) / 2)


def _find_rows_px(
    motion: Motion, points: RobotPoints, camera: Optics, time_s: np.ndarray, row_px: np.ndarray
) -> np.ndarray:
    """Return the (n, m) row in which a shutter meets each marker: the fixed point of row = y(time + delay(row))."""
    if not camera.readout_s:
        return row_px
    for _ in range(4):  # each round gains the factor of marker speed over readout speed, below 0.05
        row_px = _project_each(motion, points, camera, time_s[:, None] + camera.delay_s(row_px))[..., 1]
    return row_px


def _project_each(motion: Motion, points: RobotPoints, camera: Optics, time_s: np.ndarray) -> np.ndarray:
    """Return (..., m, 2) px of each marker at a time of its own, (..., m) s."""
    if np.ptp(time_s, axis=-1).max() == 0:
        return camera.project(points(motion.at(time_s[..., 0])))
    seen_px = camera.project(points(motion.at(time_s)))  # (..., m times, m markers, 2)
    return np.moveaxis(np.diagonal(seen_px, axis1=-3, axis2=-2), -1, -2)
