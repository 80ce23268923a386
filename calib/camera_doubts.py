"""What is doubtful about the camera of a session's videos."""

from collections.abc import Iterable

from session import CameraSpec, Flag, NotEnoughData
from swimmer import RobotSpec
from tracking import to_pool
from tracking.lens import lens_flags
from tracking.records import TrackedTrial


def camera_doubts(found: Iterable[TrackedTrial], camera: CameraSpec, robot: RobotSpec) -> tuple[Flag, ...]:
    """The doubts about lens, size and height, of each kind the first: the videos share one camera.

    Args:
        found: the tracks of every video.
        camera: of the session.
        robot: whose markers' heights parallax depends on.
    """
    flags: dict[str, Flag] = {}
    for tracks in found:
        scale = _metres_per_px(tracks, camera, robot)
        for flag in lens_flags(camera, picture_px=tracks.picture_px, metres_per_px=scale):
            flags.setdefault(flag.kind, flag)
    return tuple(flags.values())


def _metres_per_px(found: TrackedTrial, camera: CameraSpec, robot: RobotSpec) -> float | None:
    """The scale by the nose-neck distance; None where nose and neck are never seen."""
    tracks = found.counting
    heights_m = robot.marker_positions_m(tracks.markers)[:, 2]
    try:
        return to_pool(tracks, camera, tracks.confidence, heights_m)[1]
    except NotEnoughData:
        return None
