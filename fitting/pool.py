"""A swim in the pool: its markers from the tracks, regressions over its beats, and its forward speed.

`in_pool` checks the tracks of any trial and lays them on the pool; `head_frame` turns them, or a simulation, into the
frame of the head. `smooth_swim` and `design` give the regressors of a swim, and `determined` tells which series have
the samples for them. `forward_speed` is the speed that every forecast is compared with.
"""

from dataclasses import dataclass

import numpy as np
import xarray as xr

from swimcal.errors import NotEnoughData
from swimcal.robot import RobotSpec
from swimcal.session import is_exchanged
from swimcal.session_file import CameraSpec
from swimcal.tracks import markers_of
from tracking.body_model import rows_alike
from tracking.camera import to_pool
from tracking.head_frame import HeadFrame, to_head_frame
from tracking.quality import FLOOR_PX, TrackQuality, check_tracks

# Samples that a regression needs.
# Largest variance inflation: that of a marker seen in 1 frame of 100 over all phases, or on 2/3 of each beat.
_LARGEST_INFLATION = 100.0
_FRAMES_A_COLUMN = 2  # least frames for each regressor

# Whole beats and forward speed
_HARMONICS = 3  # harmonics of the nose's path and of the heading
_LEAST_BEATS = 1.0  # below this number of beats a drift cannot be told from the beat


# The markers on the pool.


@dataclass(frozen=True)
class CommonScale:
    """The scale that several swims have in common.

    Attributes:
        metres_per_px: the scale, m/px.
        names: the swims that it is the mean of.
    """

    metres_per_px: float
    names: tuple[str, ...]


def in_pool(
    tracks: xr.Dataset,
    camera: CameraSpec,
    robot: RobotSpec,
    whose: str,
    floor_px: float = FLOOR_PX,
    judged: bool = True,
) -> tuple[np.ndarray, float, TrackQuality, list[int]]:
    """Check the tracks and transform them to the pool.

    Args:
        tracks: all frames.
        camera: the camera that filmed them.
        robot: the robot.
        whose: the trial and what it is for, for the message.
        floor_px: distance that a marker may always have from where the others put it.
        judged: whether samples are checked; those of a simulation are right.

    Returns:
        Markers (n, m, 2) on the pool, m; scale, m/px; how far each sample is believed; indices of the tail's markers.

    Raises:
        NotEnoughData: no tail marker, or nose and neck are exchanged or never seen apart.
    """
    markers, believed = markers_of(tracks), TrackQuality(tracks.confidence.values, ())
    quality = check_tracks(tracks, robot, floor_px) if judged else believed
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


# Regressions over the beats of a swim.


def bridged(time_s: np.ndarray, series: np.ndarray, at_s: np.ndarray | None = None) -> np.ndarray:
    """Interpolate series over missing samples.

    Args:
        time_s: (n,) times.
        series: (n, k), nan where missing.
        at_s: (m,) times of the result; by default those of the series.

    Returns:
        (m, k); 0 where a series is never seen.
    """
    at_s = time_s if at_s is None else at_s
    result = np.zeros((len(at_s), series.shape[1]))
    for k, column in enumerate(series.T):
        if (seen := np.isfinite(column)).any():
            result[:, k] = np.interp(at_s, time_s[seen], column[seen])
    return result


def waves(turn_rad: np.ndarray, harmonics: int) -> np.ndarray:
    """Return cosine and sine of each harmonic of a turn, (n, 2 h).

    Args:
        turn_rad: (n,) turn of the crank.
        harmonics: number h of harmonics.
    """
    angles = np.multiply.outer(turn_rad, np.arange(1, harmonics + 1))  # (n, h)
    return np.stack([np.cos(angles), np.sin(angles)], axis=-1).reshape(len(turn_rad), -1)


def smooth_swim(time_s: np.ndarray, turn_rad: np.ndarray, degree: int, harmonics: int) -> np.ndarray:
    """Return the regressors of a smooth swim: powers of the time from -1 to 1, then cosine and sine of each harmonic.

    Args:
        time_s: (n,) times.
        turn_rad: (n,) turn of the crank.
        degree: highest power of the time.
        harmonics: number of harmonics.

    Returns:
        (n, degree + 1 + 2 harmonics).
    """
    scaled = 2 * (time_s - time_s[0]) / (time_s[-1] - time_s[0]) - 1
    return np.column_stack([*(scaled**k for k in range(degree + 1)), waves(turn_rad, harmonics)])


def design(time_s: np.ndarray, frequency_hz: float, harmonics: int) -> np.ndarray:
    """Return the regressors of a beat: a constant and a drift in time, then cosine and sine of each harmonic.

    Time is counted from `time_s` = 0; phases therefore refer to time 0.

    Args:
        time_s: (n,) times.
        frequency_hz: beats a second.
        harmonics: number of harmonics.

    Returns:
        (n, 2 + 2 harmonics).
    """
    span = max(float(np.ptp(time_s)), 1e-9)
    drift = (time_s - time_s.mean()) / span
    return np.column_stack([np.ones_like(drift), drift, waves(2 * np.pi * frequency_hz * time_s, harmonics)])


def weighted_fit(columns: np.ndarray, series: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return the weighted least-squares coefficients (c, k) of each of k series on the columns.

    A series without enough weight gets the solution of least norm.

    Args:
        columns: (n, c) regressors.
        series: (n, k).
        weight: (n, k).
    """
    y = np.where(weight > 0, np.nan_to_num(series), 0.0)
    count = columns.shape[1]
    products = (columns[:, :, None] * columns[:, None, :]).reshape(len(columns), -1)
    normal = (weight.T @ products).reshape(-1, count, count)  # (k, c, c)
    moment = (weight * y).T @ columns  # (k, c)
    ridge = 1e-12 * np.trace(normal, axis1=1, axis2=2)[:, None, None] + 1e-300
    return np.linalg.solve(normal + ridge * np.eye(count), moment[..., None])[..., 0].T


def determined(columns: np.ndarray, usable: np.ndarray, worst: float = _LARGEST_INFLATION) -> np.ndarray:
    """Tell which series have the samples that a regression needs.

    Args:
        columns: (n, c) regressors.
        usable: (n, m) samples of each series that count.
        worst: largest variance of a coefficient against that of orthogonal regressors seen in all n frames (the
            variance inflation factor times n over the samples; Marquardt 1970, Technometrics 12, 591).

    Returns:
        (m,) True where there are twice as many samples as regressors, and no variance is larger than that.
    """
    count, squares = columns.shape[1], np.maximum((columns**2).sum(axis=0), 1e-300)  # n times the mean squares
    scaled = columns / np.sqrt(squares)
    good = np.zeros(usable.shape[1], bool)
    for mask, alike in rows_alike(usable.T):
        if mask.sum() >= _FRAMES_A_COLUMN * count:
            values, vectors = np.linalg.eigh(scaled[mask].T @ scaled[mask])
            if values[0] > 1e-12:
                good[alike] = bool(((vectors**2 / values).sum(axis=1) <= worst).all())
    return good


# The forward speed.


def whole_beats(time_s: np.ndarray, kept: np.ndarray, frequency_hz: float) -> np.ndarray:
    """Return the mask (n,) of the longest run of whole beats from the first kept frame; all kept frames if none fits.

    Args:
        time_s: (n,) s.
        kept: (n,) which frames may be used.
        frequency_hz: beats a second.
    """
    if not kept.any():
        return kept
    start, end = time_s[kept][[0, -1]]
    frame = float(np.median(np.diff(time_s)))
    beats = np.floor((end - start + frame) * frequency_hz + 1e-6)
    if beats < _LEAST_BEATS:
        return kept
    return kept & (time_s < start + beats / frequency_hz - frame / 2 + 1e-9)


def forward_speed(time_s: np.ndarray, head: HeadFrame, kept: np.ndarray, frequency_hz: float) -> np.ndarray:
    """Return the net displacement in the pool along the mean heading, for each second.

    The nose's path is fitted by a straight line and three harmonics of the beat (least squares), so that the slope is
    that of whole beats; the mean heading is fitted together with a drift and the same harmonics. So the phases at which
    the window begins and ends, the frame rate and gaps do not bias it. Of a fish whose course bends by an angle a it is
    1 - a^2 / 40 of the speed along its path.

    Args:
        time_s: (n,) s.
        head: head frame of trajectories (..., n, m, 2); frames in which it is not seen (nan headings) do not count.
        kept: (n,) which frames may be used.
        frequency_hz: beats a second.

    Returns:
        (...) m/s, forward positive; nan where fewer than three frames are seen.
    """
    heading = head.heading_rad.reshape(-1, len(time_s))
    found = np.full(len(heading), np.nan)
    standing = np.isfinite(head.nose_m).all(axis=(-2, -1)).reshape(-1)  # no simulation that diverged
    seen = np.isfinite(heading[standing]).all(axis=0) if standing.any() else np.zeros(len(time_s), bool)
    used = kept & seen
    if used.sum() < 3:
        return found.reshape(head.heading_rad.shape[:-1])
    span = float(np.ptp(time_s[used]))
    frame = float(np.median(np.diff(time_s)))
    whole = (span + 1.5 * frame) * frequency_hz >= _LEAST_BEATS  # time stamps are not even
    harmonics = min(_HARMONICS, (int(used.sum()) - 3) // 2) if whole else 0
    read = np.linalg.pinv(design(time_s[used], frequency_hz, harmonics))[:2]  # mean and drift over the span
    velocity = np.einsum("n,snx->sx", read[1] / span, head.nose_m.reshape(len(heading), -1, 2)[standing][:, used])
    direction = heading[standing][:, used] @ read[0]
    found[standing] = -(velocity[:, 0] * np.cos(direction) + velocity[:, 1] * np.sin(direction))
    return found.reshape(head.heading_rad.shape[:-1])
