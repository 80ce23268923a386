"""How the tail moves from side to side in a video: what a motor's code is looked for in."""

from dataclasses import dataclass

import numpy as np
import xarray as xr

from fitting.in_pool import head_frame, head_is_trusted, in_pool
from fitting.series import bridged
from session import CameraSpec
from session.tracks import markers_of
from swimmer import RobotSpec


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
        even = bridged(self.time_s, np.where(self.used, self.lateral_m, np.nan), grid)
        return even[:, self.used.any(axis=0)]


def tail_motion(tracks: xr.Dataset, camera: CameraSpec, robot: RobotSpec) -> TailMotion:
    """The tail's motion in the tracks (n frames) of any trial.

    Raises:
        NotEnoughData: no tail marker, or nose and neck are never seen apart.
    """
    position_m, _, quality, tail = in_pool(tracks, camera, robot, "the code of a motor")
    lateral = head_frame(markers_of(tracks), position_m).shape_m[:, tail, 1]  # (n, k)
    trusted = head_is_trusted(markers_of(tracks), quality.weight)  # (n,)
    used = (quality.weight[:, tail] > 0) & trusted[:, None] & np.isfinite(lateral)
    return TailMotion(tracks.time.values, lateral, used)
