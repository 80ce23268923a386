"""Way from coordinates to pictures: where the markers are when a frame is exposed, and where the camera sees them."""

from dataclasses import dataclass

import numpy as np

from benchmarks.reality.camera import Picture, Sight
from benchmarks.reality.layout import Layout
from benchmarks.reality.parameters import Parameters
from benchmarks.reality.record import Drive, Record
from benchmarks.reality.world import Trial, World


@dataclass(frozen=True, eq=False)
class Recording:
    """One trial in truth and in the picture, without any error of a tracker (f frames, m markers, g hinges)."""

    trial: Trial  # trial that was made
    markers: tuple[str, ...]  # names of the markers
    time_s: np.ndarray  # (f,) time stamps of the frames, s
    position_px: np.ndarray  # (f, m, 2) places in the picture, x to the right and y down
    marker_m: np.ndarray  # (f, m, 2) places in the pool at the exposures, x and y (up in the picture), m
    # (f, 3) x, y (m) and angle (rad) of the head's frame in the pool, whose x axis runs from nose to tail
    head: np.ndarray
    hinges_rad: np.ndarray  # (f, g) bend at each hinge of the robot's description
    drive: Drive  # motion of the crank


def exposed_s(world: World, trial: Trial) -> np.ndarray:
    """Return (f,) times at which light falls on the frames of a trial, s.

    Raises:
        ValueError: before the simulation starts.
    """
    time_s = trial.time_s
    for mechanism in world.mechanisms:
        time_s = mechanism.expose(time_s)
    if time_s.min() < -trial.lead_s:
        raise ValueError(
            f"expose: found a frame exposed at {time_s.min():g} s, expected none before {-trial.lead_s:g} s"
        )
    return time_s


def film(
    world: World,
    trial: Trial,
    record: Record,
    row: int,
    layout: Layout,
    parameters: Parameters,
    markers: tuple[str, ...],
) -> Recording:
    """Film one row of a record by the camera of its world."""
    time_s = exposed_s(world, trial)
    coordinates = record.coordinates(row, time_s)
    sight = _locate_markers(coordinates, time_s, row, layout, parameters, markers)
    for mechanism in world.mechanisms:
        sight = mechanism.place(sight)
    picture = Picture(markers, trial.time_s, world.camera.project(sight.marker_m, sight.height_m), world.camera)
    for mechanism in world.mechanisms:
        picture = mechanism.picture(picture)
    bends = np.diff(coordinates[:, 2:]).reshape(len(time_s), -1, layout.hinges_per_gap).sum(axis=2)
    return Recording(
        trial=trial,
        markers=markers,
        time_s=picture.time_s,
        position_px=picture.position_px,
        marker_m=np.stack([sight.marker_m.real, sight.marker_m.imag], axis=-1),
        head=coordinates[:, :3],
        hinges_rad=bends,
        drive=record.drive(row, trial.duration_s),
    )


def _locate_markers(
    coordinates: np.ndarray,
    time_s: np.ndarray,
    row: int,
    layout: Layout,
    parameters: Parameters,
    markers: tuple[str, ...],
) -> Sight:
    direction = np.exp(1j * coordinates[:, 2:])  # (f, l)
    origin = coordinates[:, :1] + 1j * coordinates[:, 1:2] + np.cumsum(layout.reach_m * direction, axis=1)
    origin = origin - layout.reach_m * direction
    link = [layout.link_of(layout.robot.markers[name].body) for name in markers]
    axis = direction[:, link]
    return Sight(
        names=markers,
        time_s=time_s,
        marker_m=origin[:, link] + parameters.marker_m[row] * axis,
        axis=axis,
        height_m=np.zeros(axis.shape),
    )
