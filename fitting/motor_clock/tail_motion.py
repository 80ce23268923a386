"""How the tail moves from side to side in a video: what a motor's code is looked for in."""

from dataclasses import dataclass

import numpy as np

from fitting.trial import tail_markers
from session import CameraSpec, NotEnoughData, Tracks
from swimmer import RobotSpec
from tracking import check_tracks, to_head_frame, to_pool


@dataclass(frozen=True, eq=False)
class TailMotion:
    """The lateral motion of k tail markers in n frames, in the head frame.

    Attributes:
        time_s: (n,) on the clock of the video, s.
        lateral_m: (n, k) m; nan where missing.
        used: (n, k) True where a sample is there and not flagged.
    """

    time_s: np.ndarray
    lateral_m: np.ndarray
    used: np.ndarray

    @property
    def frame_s(self) -> float:
        """Time between frames, s."""
        return float(np.median(np.diff(self.time_s)))

    def evenly(self) -> np.ndarray:
        """(f, k) lateral motion `frame_s` apart from the first frame on, missing samples bridged; m."""
        grid = np.arange(self.time_s[0], self.time_s[-1] + 1e-9, self.frame_s)
        columns = [
            np.interp(grid, self.time_s[used], lateral[used])
            for lateral, used in zip(self.lateral_m.T, self.used.T, strict=True)
            if used.any()
        ]
        return np.stack(columns, axis=1) if columns else np.zeros((len(grid), 0))


def tail_motion(tracks: Tracks, camera: CameraSpec, robot: RobotSpec) -> TailMotion:
    """The tail's motion in the tracks (n frames) of any trial.

    Raises:
        NotEnoughData: no tail marker, or nose and neck are never seen apart.
    """
    quality = check_tracks(tracks, robot)
    pool = to_pool(tracks, camera, quality.weight, robot.marker_positions_m(tracks.markers)[:, 2])
    tail = tail_markers(robot, pool.markers)
    if not tail:
        raise NotEnoughData("none of the markers sits on the tail; a motor's code needs at least one to be seen in")
    nose, neck = pool.markers.index("nose"), pool.markers.index("neck")
    lateral = to_head_frame(pool.position_m, nose, neck).shape_m[:, tail, 1]  # (n, k)
    trusted = (quality.weight[:, nose] > 0) & (quality.weight[:, neck] > 0)  # (n,)
    used = (quality.weight[:, tail] > 0) & trusted[:, None] & np.isfinite(lateral)
    return TailMotion(tracks.time_s, lateral, used)
