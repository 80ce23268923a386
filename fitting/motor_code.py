"""Search for a motor's codes in a video: the tail's motion against that of the logged crank.

The tail's place is a smooth function of the crank's angle, and the code spans a fifth of a turn of it. Over the code a
marker's lateral place is therefore close to a + b cos(angle) + c sin(angle), whatever the crank's zero and the robot.
Every offset is tried first (`search`); then the exact moment of each code is found (`code_delay`), with a standard
error that allows for tracking errors that last. All markers have equal weight. Weights by the covariance of their
errors, mostly those of nose and neck, would be four times as exact in air; in water the markers lag each by another
time, and it then trusts the wrong differences.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.lib.stride_tricks import sliding_window_view

from fitting.lasting_noise import LastingNoise, RegressionProblem, descend, regress
from fitting.pool import bridged, head_frame, head_is_trusted, in_pool
from swimcal.robot import RobotSpec
from swimcal.runs import CrankTurn
from swimcal.session_file import CameraSpec
from swimcal.tracks import markers_of

APART_S = 0.25  # least difference of two different offsets: one chip of the code
_STILL_M = 1e-5  # motion that keeps the share of a tail at rest at 0
FARTHEST_S = 0.06  # largest shift from the common offset; beyond it the tail hardly moved in this code
COMPLETE = 0.8  # share of the code's frames that a marker must be seen in to count
_STEPS = 5  # Gauss-Newton steps
_STEP_S = 0.03  # longest step of the offset
_START_NOISE = LastingNoise(duration_s=0.1, white_share=0.3, sd_m=1e-3)  # first guess
_MAP = 4  # numbers for each marker: constant, drift, cosine, sine


@dataclass(frozen=True, eq=False)
class LateralMotion:
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
        """Return the lateral motion (f, k) `frame_s` apart from the first frame on, missing samples interpolated, m."""
        grid = np.arange(self.time_s[0], self.time_s[-1] + 1e-9, self.frame_s)
        even = bridged(self.time_s, np.where(self.used, self.lateral_m, np.nan), grid)
        return even[:, self.used.any(axis=0)]


def tail_motion(tracks: xr.Dataset, camera: CameraSpec, robot: RobotSpec) -> LateralMotion:
    """Return the tail's motion in the tracks (n frames) of any trial.

    Args:
        tracks: n frames.
        camera: the camera that filmed them.
        robot: the robot.

    Raises:
        NotEnoughData: no tail marker, or nose and neck are never seen apart.
    """
    position_m, _, quality, tail = in_pool(tracks, camera, robot, "the code of a motor")
    lateral = head_frame(markers_of(tracks), position_m).shape_m[:, tail, 1]  # (n, k)
    trusted = head_is_trusted(markers_of(tracks), quality.weight)  # (n,)
    used = (quality.weight[:, tail] > 0) & trusted[:, None] & np.isfinite(lateral)
    return LateralMotion(tracks.time.values, lateral, used)


class CodeOffset(NamedTuple):
    """Best offset of the codes.

    Attributes:
        offset_s: motor clock minus video clock, s.
        gain: minus the sum of ln(1 - explained) over the codes.
        next_gain: the next best gain.
    """

    offset_s: float
    gain: float
    next_gain: float


def search(tail: LateralMotion, turn: CrankTurn, codes: list[tuple[float, float]]) -> CodeOffset | None:
    """Try every offset at which a code is in the video; None where none can be.

    Args:
        tail: n frames.
        turn: turn of the crank.
        codes: first and last instant of each code, on the clock of `turn`, s.
    """
    motion, frame_s = tail.evenly(), tail.frame_s
    first = [_first_frames(tail, code, motion) for code in codes]
    if not any(len(offsets) for offsets in first):
        return None
    low, high = (f([f(offsets) for offsets in first if len(offsets)]) for f in (np.min, np.max))
    grid = np.arange(low, high + frame_s / 2, frame_s)
    gain = np.zeros(len(grid))
    for code, offsets in zip(codes, first, strict=True):
        if len(offsets):
            share = explain_motion(motion, frame_s, turn, code)
            gain += np.interp(grid, offsets[::-1], -np.log1p(-share)[::-1], left=0.0, right=0.0)
    best = int(np.argmax(gain))
    others = gain[np.abs(grid - grid[best]) > APART_S]
    return CodeOffset(float(grid[best]), float(gain[best]), float(others.max(initial=0.0)))


def explain_motion(motion_m: np.ndarray, frame_s: float, turn: CrankTurn, code: tuple[float, float]) -> np.ndarray:
    """Return the share of the tail's motion that the crank's explains, where the code begins at each of w frames, (w,).

    Args:
        motion_m: (f, k) of the tail, evenly spaced.
        frame_s: their spacing, s.
        turn: turn of the crank.
        code: first and last instant, on the clock of `turn`, s.
    """
    length = _frames(code, frame_s)
    angle = turn.angle(code[0] + frame_s * np.arange(length))
    steady = np.linalg.qr(np.stack([np.ones(length), np.arange(length)], axis=1))[0]  # (l, 2)
    moving = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    moving = np.linalg.qr(moving - steady @ (steady.T @ moving))[0]
    windows = sliding_window_view(motion_m, length, axis=0)  # (w, k, l)
    windows = windows - windows.mean(axis=2, keepdims=True)
    total = (windows**2).sum(axis=(1, 2)) - ((windows @ steady) ** 2).sum(axis=(1, 2))
    by_crank = ((windows @ moving) ** 2).sum(axis=(1, 2))
    return np.clip(by_crank / (np.maximum(total, 0.0) + motion_m.shape[1] * length * _STILL_M**2), 0.0, 1 - 1e-9)


def _frames(code: tuple[float, float], frame_s: float) -> int:
    return round((code[1] - code[0]) / frame_s)


def _first_frames(tail: LateralMotion, code: tuple[float, float], motion_m: np.ndarray) -> np.ndarray:
    """Return the falling offsets (w,), s, at which the code begins at each frame and still ends in the video."""
    places = len(motion_m) - _frames(code, tail.frame_s) + 1 if motion_m.shape[1] else 0
    return code[0] - tail.time_s[0] - tail.frame_s * np.arange(max(places, 0))


class CodeDelay(NamedTuple):
    """Delay of one code that was seen.

    Attributes:
        offset_s: motor clock minus video clock in the middle of the code.
        se_s: its standard error.
        middle_s: middle of the code, on the clock of the video.
        explained: share of the tail's motion that the crank's explains, 0 to 1.
    """

    offset_s: float
    se_s: float
    middle_s: float
    explained: float


def code_delay(tail: LateralMotion, turn: CrankTurn, code: tuple[float, float], offset_s: float) -> CodeDelay | None:
    """Refine the moment of a code; None where the code is not in the video, or the refinement leaves it.

    Every marker has a constant, a drift, and a linear map of cosine and sine of the crank's angle of its own; all share
    the offset.

    Args:
        tail: n frames.
        turn: turn of the crank, on the motor's clock.
        code: first and last instant, on that clock, s.
        offset_s: motor clock minus video clock, to a few frames.
    """
    begins_s, ends_s = code[0] - offset_s, code[1] - offset_s
    if begins_s < tail.time_s[0] - tail.frame_s or ends_s > tail.time_s[-1] + tail.frame_s:
        return None
    frames = np.flatnonzero((tail.time_s >= begins_s) & (tail.time_s < ends_s))
    seen = tail.used[frames].mean(axis=0) >= COMPLETE  # (k,)
    frames = frames[tail.used[np.ix_(frames, seen)].all(axis=1)] if seen.any() else frames[:0]
    if len(frames) < COMPLETE / 2 * (ends_s - begins_s) / tail.frame_s:
        return None
    time_s, lateral = tail.time_s[frames], tail.lateral_m[np.ix_(frames, seen)]
    found, noise = offset_s, _START_NOISE
    for step in range(_STEPS):
        model = _linearise(time_s, lateral, turn, found)
        result = descend(model, noise) if step < _STEPS - 1 else regress(model)
        found += float(np.clip(result.step[0], -_STEP_S, _STEP_S))
    if abs(found - offset_s) > FARTHEST_S:
        return None
    columns = _crank(time_s, turn, found)[0]
    residual, total = _residual(columns, lateral), _residual(columns[:, :2], lateral)
    markers = int(seen.sum())
    few = np.sqrt(markers / (markers - 1)) if markers > 1 else 1.0  # CR1; Cameron and Miller 2015
    return CodeDelay(
        offset_s=found,
        se_s=float(few * np.sqrt(result.covariance[0, 0])),
        middle_s=sum(code) / 2 - found,
        explained=1 - float((residual**2).sum() / max(float((total**2).sum()), 1e-30)),
    )


def _crank(time_s: np.ndarray, turn: CrankTurn, offset_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the regressors of every marker (n, 4), and their derivative by the offset."""
    angle, speed = turn.angle(time_s + offset_s), turn.speed(time_s + offset_s)
    none = np.zeros_like(time_s)
    columns = [none + 1, time_s - time_s.mean(), np.cos(angle), np.sin(angle)]
    return np.stack(columns, axis=1), np.stack([none, none, -np.sin(angle) * speed, np.cos(angle) * speed], axis=1)


def _residual(columns: np.ndarray, series: np.ndarray) -> np.ndarray:
    return series - columns @ np.linalg.lstsq(columns, series, rcond=None)[0]


def _linearise(time_s: np.ndarray, lateral_m: np.ndarray, turn: CrankTurn, offset_s: float) -> RegressionProblem:
    """Linearise the motion about an offset and its best maps: derivatives by the offset (first) and by the maps."""
    columns, slopes = _crank(time_s, turn, offset_s)
    maps = np.linalg.lstsq(columns, lateral_m, rcond=None)[0]  # (4, k)
    markers = lateral_m.shape[1]
    jacobian = np.zeros((*lateral_m.shape, 1 + _MAP * markers))
    jacobian[..., 0] = slopes @ maps
    for k in range(markers):
        jacobian[:, k, 1 + _MAP * k : 1 + _MAP * (k + 1)] = columns
    none = np.zeros(1 + _MAP * markers)
    used = np.ones(lateral_m.shape, bool)
    return RegressionProblem(time_s, used, lateral_m - columns @ maps, jacobian, none, none)
