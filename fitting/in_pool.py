"""Tracks checked and transformed to the pool, with the markers of the tail: the start of every measurement."""

import numpy as np
import xarray as xr

from session import CameraSpec, NotEnoughData
from session.head_check import is_exchanged
from session.tracks import markers_of
from swimmer import RobotSpec
from tracking import HeadFrame, TrackQuality, check_tracks, to_head_frame, to_pool
from tracking.quality import FLOOR_PX


def in_pool(
    tracks: xr.Dataset, camera: CameraSpec, robot: RobotSpec, whose: str, floor_px: float = FLOOR_PX
) -> tuple[np.ndarray, float, TrackQuality, list[int]]:
    """Check the tracks and transform them to the pool.

    Args:
        tracks: all frames.
        camera: the camera that filmed them.
        robot: the robot.
        whose: the trial and what it is for, for the message.
        floor_px: distance that a marker may always have from where the others put it.

    Returns:
        Markers (n, m, 2) on the pool, m; scale, m/px; how far each sample is believed; indices of the tail's markers.

    Raises:
        NotEnoughData: no tail marker, or nose and neck are exchanged or never seen apart.
    """
    quality, markers = check_tracks(tracks, robot, floor_px), markers_of(tracks)
    if is_exchanged(tracks, robot.marker_positions_m(markers)):
        raise NotEnoughData(
            f"{whose}: nose and neck are exchanged; found the markers of the tail on the nose's side, expected them on "
            "the neck's. Exchange the two in its boxes, or in its tracks"
        )
    position_m, metres_per_px = to_pool(tracks, camera, quality.weight, robot.marker_positions_m(markers)[:, 2])
    tail = tail_markers(robot, markers)
    if not tail:
        raise NotEnoughData(f"{whose}: none of its markers sits on the tail; at least one is needed")
    return position_m, metres_per_px, quality, tail


def tail_markers(robot: RobotSpec, markers: tuple[str, ...]) -> list[int]:
    """Return the indices of the markers behind the head, from head to fin."""
    behind = [i for i, name in enumerate(markers) if robot.markers[name].body != "head"]
    return sorted(behind, key=lambda i: robot.markers[markers[i]].position_m[0])


def head_frame(markers: tuple[str, ...], position_m: np.ndarray, seen: np.ndarray | None = None) -> HeadFrame:
    """Turn markers (..., n, m, 2) of these m names into the head frame, as `to_head_frame` does.

    A simulation that is compared with a trial is seen through the trial's own gaps.

    Args:
        markers: names of the m markers.
        position_m: (..., n, m, 2) m.
        seen: (n,) frames whose nose and neck are trusted in the trial.
    """
    return to_head_frame(position_m, markers.index("nose"), markers.index("neck"), seen)


def head_is_trusted(markers: tuple[str, ...], weight: np.ndarray) -> np.ndarray:
    """Tell in which frames (n,) both nose and neck are believed.

    Args:
        markers: names of the m markers.
        weight: (n, m) weights of the samples.
    """
    return (weight[:, markers.index("nose")] > 0) & (weight[:, markers.index("neck")] > 0)
