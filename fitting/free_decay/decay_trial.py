"""A free decay as measured: the tail markers beside the clamped head, from the release until the tail is at rest."""

from dataclasses import dataclass

import numpy as np

from fitting.free_decay.clamp import clamp_flags
from fitting.free_decay.release import Release, find_release
from fitting.in_pool import in_pool
from session import CameraSpec, Flag, NotEnoughData, Tracks
from swimmer import RobotSpec
from tracking import QualityLimits, to_head_frame

# The shape that `check_tracks` learns from a trial is that of its many frames at rest: the few in which the tail is
# bent look wrong to it. Only gross faults are left to it; the twin judges the others (`fitting.free_decay.decay_fit`).
FAR_OUT = QualityLimits(floor_px=75.0)
FEWEST_FRAMES = 12


@dataclass(frozen=True, eq=False)
class DecayTrial:
    """The tail of a clamped robot swinging freely, n frames of k tail markers from the release on.

    Attributes:
        name: of the trial.
        markers: the k tail markers, from head to fin.
        time_s: (n,) from the first frame after the release, s.
        position_m: (n, k, 2) in the robot frame (x from nose to tail, y to the right of a swimmer seen from above), m.
        weight: (n, k) 0 where a sample is missing or flagged.
        first_frame: of the recording that is kept, just after the release.
        release_s: its time in the recording, s.
        metres_per_px: scale of the picture.
        flags: of the tracks, the release and the clamp.
    """

    name: str
    markers: tuple[str, ...]
    time_s: np.ndarray
    position_m: np.ndarray
    weight: np.ndarray
    first_frame: int
    release_s: float
    metres_per_px: float
    flags: tuple[Flag, ...] = ()

    @property
    def lateral_m(self) -> np.ndarray:
        """(n, k) across the body, nan where a sample does not count."""
        return np.where(self.weight > 0, self.position_m[..., 1], np.nan)


def measure_decay_trial(name: str, tracks: Tracks, camera: CameraSpec, robot: RobotSpec) -> DecayTrial:
    """Checks and scales the tracks of a free decay, finds its release, and turns them into the robot frame.

    The head is clamped, so its axis is that of the median nose and the median neck: their tracking errors would
    otherwise reach the fin four times enlarged.

    Args:
        name: of the trial.
        tracks: in pixels, with nose, neck and at least one tail marker.
        camera: clock, scale length and lens.
        robot: the robot.

    Raises:
        NotEnoughData: no tail marker, no release, or too few frames after it.
    """
    place_m, metres_per_px, quality, tail = in_pool(tracks, camera, robot, f"trial {name}", FAR_OUT)
    time_s = tracks.time_s - tracks.time_s[0]
    position_m = _in_robot_frame(place_m, tracks.markers, quality.weight, robot)
    weight = np.where(np.isfinite(position_m).all(axis=-1), quality.weight, 0.0)
    release = find_release(time_s, position_m[:, tail, 1], weight[:, tail], name)
    kept = slice(release.first, release.last + 1)
    if release.last - release.first + 1 < FEWEST_FRAMES:
        raise NotEnoughData(
            f"trial {name}: {release.last - release.first + 1} frames after the release at "
            f"{time_s[release.first]:.2f} s; at least {FEWEST_FRAMES} are needed. Record until the tail is at rest"
        )
    seen_m = np.where(weight[kept, :, None] > 0, position_m[kept], np.nan)
    clamp = clamp_flags(seen_m, tracks.markers, tail[-1], _reach(robot, tracks.markers[tail[-1]]))
    return DecayTrial(
        name=name,
        markers=tuple(tracks.markers[i] for i in tail),
        time_s=time_s[kept] - time_s[release.first],
        position_m=position_m[kept][:, tail],
        weight=weight[kept][:, tail],
        first_frame=release.first,
        release_s=float(time_s[release.first]),
        metres_per_px=metres_per_px,
        flags=(*_within(quality.flags, release), *release.flags, *clamp),
    )


def _in_robot_frame(
    position_m: np.ndarray, markers: tuple[str, ...], weight: np.ndarray, robot: RobotSpec
) -> np.ndarray:
    """(n, m, 2) along and across the line from the median nose to the median neck, in the robot frame."""
    nose, neck = markers.index("nose"), markers.index("neck")
    still = position_m.copy()
    for head in (nose, neck):
        trusted = (weight[:, head] > 0) & np.isfinite(position_m[:, head]).all(axis=-1)
        if not trusted.any():
            raise NotEnoughData(f"{markers[head]} is never seen well enough to tell where the head is; track it again")
        still[:, head] = np.median(position_m[trusted, head], axis=0)
    turned = to_head_frame(np.concatenate([position_m, still[:, [nose, neck]]], axis=1), -2, -1).shape_m[:, :-2]
    return turned + robot.marker_positions_m(("nose",))[0, :2]


def _reach(robot: RobotSpec, marker: str) -> float:
    """From the nose to a marker in lengths from nose to neck."""
    nose, neck, far = robot.marker_positions_m(("nose", "neck", marker))[:, 0]
    return float((far - nose) / (neck - nose))


def _within(flags: tuple[Flag, ...], release: Release) -> tuple[Flag, ...]:
    """Those that concern the decay: a tail that is held still, say, looks like a video that stands."""
    spans = [flag.frames or (release.first, release.last) for flag in flags]
    return tuple(
        flag for flag, (first, last) in zip(flags, spans, strict=True) if last > release.first and first <= release.last
    )
