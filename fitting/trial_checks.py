"""Checks of a whole swim trial before any fit.

A check either flags the trial, which is used all the same, or raises `NotEnoughData`: then the trial is left out, and
the others go on.
"""

from collections.abc import Sequence

import numpy as np

from fitting.frequency import (
    CLEAR,
    FEW_BEATS,
    HARMONICS,
    JUDGED,
    LEAST_EXPLAINED,
    SwimFrequency,
    estimate_frequency,
    standard_error,
)
from fitting.pool import design, forward_speed, smooth_swim, weighted_fit
from swimcal.errors import NotEnoughData
from swimcal.flags import Flag
from swimcal.robot import RobotSpec
from swimcal.session_file import OTHER_UNIT, CameraSpec, rate_is_off, usual_spacing_s
from tracking.head_frame import HeadFrame
from tracking.lens_check import correlated_frames

SCALE_OFF = 0.03
"""Relative difference of the scale that is worth a flag: a ruler places nose and neck to 1 or 2 mm of some 140."""
TAIL_FIRST = "tail_first"
"""The flag of a trial in which the robot swims backward."""
WOBBLES = "path_wobbles"
"""The flag of a trial in which the head goes to and fro beside its beat, without turning."""
CREEPS = "marker_creeps"
"""The flag of a trial in which a marker slides aside of its neighbours."""
BEARING = ("unread_marker", CREEPS, TAIL_FIRST, "turns", "scale_drifts", "scale_apart")
"""Kinds of flags of a fitted trial that bear on every coefficient."""
_SURE = 4.0  # standard errors from which a drift is certain
_LASTS = 10.0  # least number of frames for which an error of a box stays
_SCALE_DRIFTS = 0.01  # relative drift of the scale from the first to the last compared frame
_LIKELY = 2.5  # standard errors from which a drift is likely
_LIKELY_DRIFT = 0.02  # least drift of the scale that is worth a flag though it is not certain
_CREEP = 0.1  # least way of a marker aside of its neighbours, relative to nose to neck; public trials have up to 0.06
_CHORD = 0.02  # share by which the net displacement of a fish that turns may be shorter than its path
_WOBBLE = 0.03  # amplitude relative to nose to neck; public trials have 0.004, noise of 1.5 px that lasts 0.017
_WOBBLE_DEGREE = 3  # degree of the smooth path
_SLOWEST_WOBBLE_HZ = 0.2  # slower than that fish wander
_FASTEST_WOBBLE_HZ = 3.0
# A swim is unsteady if its speeds in the first beats, the last and over all differ by more than both of these.
_UNSTEADY = 0.07  # public trials have 0.05, simulated swims 0.02
_UNSTEADY_M_S = 0.008
_LEAST_OF_END = 16  # least number of frames in the first, and in the last, beats
_LEAST_OF_END_S = 0.6  # least duration of the first, and of the last, beats
_SEEN_OF_END = 0.8  # least share of the first or last beats that is seen
_RATE_CHANGES = 0.03  # relative difference of the beat frequencies of the two halves; public trials have 0.008
_LEAST_OF_HALF = 1.2  # least number of beats in either half
_RESTS_S = 0.2  # least rest that is flagged
LEAST_OF_PART = 0.2
"""Share of its motion that a beat explains where the tail beats for a quarter of the trial: of noise it is less."""
# The least swing holds for this many beats: the swing that noise makes falls with the root of the time.
_OF_BEATS = 5.0
_LEAST_SWING = 0.02  # relative to the robot's length: published swims have 0.09 and more, lasting noise up to 0.02
_CLEAR_BEATS = 3.0  # least number of beats of a clear one, which may be small
_LEAST_CLEAR = 0.004  # least swing of a clear beat at the end of the fin, relative to the robot's length
_LEAST_REACH = 0.1  # no nearer to the tail's root is less swing expected
_NEAR_ROOT = 0.3  # a tail marker no further back hardly swings
_LEAST_OF_FEW = 0.75  # least share of its motion that a beat explains in few beats
_LEAST_BEATS = 2.0  # least number of beats in a row
_BACKWARD_M_S = 0.005  # a robot slower than this beats on the spot
_UNSEEN_END_S = 0.5  # least time at the end without a head that is flagged


def check_clock_and_scale(time_s: np.ndarray, camera: CameraSpec, robot: RobotSpec) -> tuple[Flag, ...]:
    """Check that time stamps (n,) fit the nominal frame rate, and the scale length the robot.

    Args:
        time_s: (n,) time stamps.
        camera: the camera, with frame rate and scale length.
        robot: the robot.

    Raises:
        NotEnoughData: the frame rate is off by more than 5 %, or the scale by so much that it must be another unit.
    """
    spacing_s, scale = usual_spacing_s(time_s), camera.scale_length_m / robot.scale_length_m
    if rate_is_off(camera.fps, *spacing_s):
        raise NotEnoughData(
            f"its time stamps give {1 / spacing_s[0]:.3g} frames a second, the session says {camera.fps:g}; "
            "expected the same within 5 %. Correct the one that is wrong: frequencies and speeds go by it."
        )
    if not 1 / OTHER_UNIT < scale < OTHER_UNIT:
        raise NotEnoughData(
            f"[camera] scale_length_m is {camera.scale_length_m:g}, but nose and neck of {robot.name} are "
            f"{robot.scale_length_m:.4g} m apart; expected about the same. Is it in metres, and is the robot right?"
        )
    if abs(scale - 1) <= SCALE_OFF:
        return ()
    message = (
        f"[camera] scale_length_m is {camera.scale_length_m:g} m, {100 * (scale - 1):+.0f} % off the "
        f"{robot.scale_length_m:.4g} m between nose and neck of {robot.name}: all lengths and speeds scale with it"
    )
    return (Flag("scale_off_robot", message=message),)


def reach_along_tail(robot: RobotSpec, markers: Sequence[str]) -> float:
    """Return how far back the last of some markers sits: 0 at the tail's root, 1 at the end of the fin.

    Args:
        robot: the robot.
        markers: names of the markers, at least one.
    """
    last_m = max(robot.markers[name].position_m[0] for name in markers)
    root_m, end_m = robot.tail.start_m, robot.fin_root_x_m + robot.caudal_fin.length_m
    return float(np.clip((last_m - root_m) / (end_m - root_m), 0.0, 1.0))


def check_beat(
    beat: SwimFrequency, robot: RobotSpec, reach: float = 1.0, least_explained: float = LEAST_EXPLAINED
) -> None:
    """Check that a tail beats, and that its beat explains most of its motion, or at least some share of it.

    Args:
        beat: the beat.
        robot: the robot.
        reach: how far back its last marker sits, see `reach_along_tail`: near the root a tail hardly swings.
        least_explained: least share of the motion that the beat explains.

    Raises:
        NotEnoughData: it does not; noise and drift have a strongest frequency too.
    """
    clear = beat.clear and beat.beats >= _CLEAR_BEATS
    least = (
        _LEAST_CLEAR * max(reach, _LEAST_REACH)
        if clear
        else _LEAST_SWING * min(1.0, float(np.sqrt(_OF_BEATS / beat.beats)))
    )
    least_m = least * robot.length_m
    if beat.swing_m < least_m:
        near_root = "Track a marker further back: near its root a tail hardly swings"
        raise NotEnoughData(
            f"no lasting beat: at the likeliest frequency, {beat.hz:.3g} Hz, the tail swings by "
            f"{1000 * beat.swing_m:.1f} mm to either side; at least {1000 * least_m:.1f} mm are expected. "
            + (near_root if reach < _NEAR_ROOT else "Did the robot swim?")
        )
    if beat.beats < FEW_BEATS and least_explained > LEAST_OF_PART:
        least_explained = _LEAST_OF_FEW if beat.beats >= _LEAST_BEATS else CLEAR
    if beat.explained < least_explained:
        raise NotEnoughData(
            f"no lasting beat: the likeliest, {beat.hz:.3g} Hz, explains {100 * beat.explained:.0f} % of what the tail "
            f"does in {beat.beats:.1f} beats, at least {100 * least_explained:.0f} % are expected. Did the robot swim? "
            "Cut the recording to the swim, or leave the trial out"
        )


def check_lasting(time_s: np.ndarray, used: slice, beat: SwimFrequency) -> None:
    """Check that the stretch in which the tail beats holds a few beats.

    Args:
        time_s: (n,) s.
        used: frames of the stretch.
        beat: the beat.

    A trial of fewer than `JUDGED` beats is not refused: of that only a short rest at an end was left out.

    Raises:
        NotEnoughData: it does not: a robot at rest has a strongest frequency too.
    """
    lasts_s, whole_s = float(time_s[used.stop - 1] - time_s[used.start]), float(np.ptp(time_s))
    if lasts_s * beat.hz < _LEAST_BEATS and whole_s * beat.hz >= JUDGED:
        raise NotEnoughData(
            f"no lasting beat: at the likeliest frequency, {beat.hz:.3g} Hz, the tail beats for {lasts_s:.1f} of "
            f"{whole_s:.1f} s; at least {_LEAST_BEATS:g} beats in a row are expected. Did the robot swim?"
        )


def rest_flags(time_s: np.ndarray, used: slice) -> tuple[Flag, ...]:
    """Flag the frames before and after the stretch in which the tail beats.

    Args:
        time_s: (n,) s.
        used: frames of the stretch.
    """
    first, last = used.start, used.stop - 1
    flags = []
    for frames, when in (((0, first - 1), "at first"), ((last + 1, len(time_s) - 1), "at the end")):
        seconds = float(time_s[frames[1]] - time_s[frames[0]]) if frames[1] > frames[0] else 0.0
        if seconds > _RESTS_S:
            message = f"the tail does not beat {when}, for {seconds:.1f} s: these frames are left out"
            flags.append(Flag("rests", frames=frames, message=message))
    return tuple(flags)


def rate_flags(time_s: np.ndarray, lateral_m: np.ndarray, weight: np.ndarray, hz: float) -> tuple[Flag, ...]:
    """Flag a beat that becomes faster or slower: the frequencies of its two halves differ.

    Args:
        time_s: (n,) s.
        lateral_m: (n, k) sideways motion of k tail markers in the head frame, m.
        weight: (n, k) of each sample, 0 leaves it out.
        hz: beats a second of the whole.
    """
    shown = np.flatnonzero((weight > 0).any(axis=1))
    middle = (shown[0] + shown[-1]) // 2 if len(shown) else 0
    try:
        halves = [
            estimate_frequency(time_s[part], lateral_m[part], weight[part])
            for part in (slice(0, middle), slice(middle, len(time_s)))
        ]
    except NotEnoughData:
        return ()
    first, last = (half.hz for half in halves)
    error = float(np.linalg.norm([half.se_hz for half in halves]))
    if min(half.beats for half in halves) < _LEAST_OF_HALF or not abs(last - first) > max(
        _RATE_CHANGES * hz, _SURE * error
    ):
        return ()
    message = (
        f"its beat changes while it swims: {first:.3g} Hz in the first half, {last:.3g} Hz in the second. It has no "
        "single speed or frequency: cut the recording to a steady part, or give the motor's log"
    )
    return (Flag("unsteady", message=message),)


def motion_flags(
    time_s: np.ndarray, head: HeadFrame, kept: np.ndarray, speed: float, hz: float, scale_length_m: float
) -> tuple[Flag, ...]:
    """Flag a fish that swims tail first or unsteadily, a bent course, and a head that goes to and fro beside the beat.

    Args:
        time_s: (n,) s.
        head: the n head frames of the trial.
        kept: (n,) frames that are compared.
        speed: forward speed, m/s.
        hz: beats a second.
        scale_length_m: distance from nose to neck, m.
    """
    flags = []
    if speed < -_BACKWARD_M_S:
        message = (
            f"it swims tail first, at {-1000 * speed:.0f} mm/s: does water carry it, are nose and neck exchanged, or "
            "does the film run backward?"
        )
        flags.append(Flag(TAIL_FIRST, message=message))
    turned, _ = _drift(time_s, head.heading_rad, kept, hz)
    bends = abs(turned) > np.sqrt(40 * _CHORD)
    first, last, error = _ends(time_s, head, kept, hz)
    paces = (first, last) if bends else (first, last, speed)
    if np.ptp(paces) > max(_UNSTEADY * abs(speed), _UNSTEADY_M_S, _LIKELY * error):
        message = (
            f"its speed changes while it is compared: {1000 * first:.0f} mm/s at first, {1000 * last:.0f} at the end, "
            f"{1000 * speed:.0f} in all: was it pushed or slowed, does its beat change, or was the camera moved?"
        )
        flags.append(Flag("unsteady", message=message))
    if bends:
        message = (
            f"it turns by {np.degrees(turned):+.0f} degrees while it is compared: the net displacement, which its "
            f"speed is, is {100 * turned**2 / 40:.0f} % shorter than its path"
        )
        flags.append(Flag("turns", message=message))
    seen = kept & np.isfinite(head.heading_rad)
    wobble_m, wobble_hz = _wobble(time_s[seen], head.path_m[seen], hz)
    if wobble_m > _WOBBLE * scale_length_m:
        message = (
            f"its head goes to and fro by {1000 * wobble_m:.0f} mm at {wobble_hz:.2f} Hz, besides the beat and without "
            "turning: was the camera shaken, or did waves move the robot?"
        )
        flags.append(Flag(WOBBLES, message=message))
    return tuple(flags)


def _ends(time_s: np.ndarray, head: HeadFrame, kept: np.ndarray, hz: float) -> tuple[float, float, float]:
    """Return the forward speeds in the first and last beats that are compared, and their difference's error, m/s.

    Where too little is seen they are nan.
    """
    seen = kept & np.isfinite(head.heading_rad)
    frame_s = float(np.median(np.diff(time_s)))
    beats_s = np.ceil(max(_LEAST_OF_END * frame_s, _LEAST_OF_END_S) * hz) / hz
    begins, ends = time_s[seen][[0, -1]] if seen.any() else (0.0, 0.0)
    parts = [seen & (time_s <= begins + beats_s + 1e-9), seen & (time_s >= ends - beats_s - 1e-9)]
    whole = ends - begins >= 2 * beats_s and all(part.sum() * frame_s > _SEEN_OF_END * beats_s for part in parts)
    first, last = (float(forward_speed(time_s, head, part, hz)) if whole else np.nan for part in parts)
    error = float(np.linalg.norm([_speed_error(time_s, head, seen, part, hz) for part in parts])) if whole else np.nan
    return first, last, error


def _speed_error(time_s: np.ndarray, head: HeadFrame, seen: np.ndarray, part: np.ndarray, hz: float) -> float:
    """Return the standard error of the forward speed in a part of the seen frames (n,), m/s.

    What a smooth path and the beat leave of all seen frames tells the noise: that in a part tells too little of noise
    that lasts as long.
    """
    seconds, ahead_m, within = time_s[seen], head.path_m[seen, :1], part[seen]
    smooth = smooth_swim(seconds, 2 * np.pi * hz * seconds, _WOBBLE_DEGREE, HARMONICS)
    even = np.ones_like(ahead_m)
    residual = ahead_m - smooth @ weighted_fit(smooth, ahead_m, even)
    own = np.delete(design(seconds[within], hz, HARMONICS), 1, axis=1)  # all but the drift
    ramp = (seconds[within] - seconds[within].mean())[:, None]
    slope = np.zeros_like(ahead_m)
    slope[within] = ramp - own @ weighted_fit(own, ramp, even[within])
    return standard_error(smooth, slope, residual, even, 1 / (hz * float(np.median(np.diff(seconds)))))


def _wobble(time_s: np.ndarray, path_m: np.ndarray, hz: float) -> tuple[float, float]:
    """Return amplitude (m) and frequency of the likeliest oscillation of a path (k, 2) that is not of the beat.

    At least two periods of it are seen. The path is that of the head along its own axes, with a cubic and three
    harmonics of the beat: a fish that winds its way goes where its head points, and does not wobble.
    """
    turn_rad, lasts_s = 2 * np.pi * hz * time_s, float(np.ptp(time_s))
    smooth, _ = np.linalg.qr(smooth_swim(time_s, turn_rad, _WOBBLE_DEGREE, HARMONICS))
    rest = path_m - smooth @ (smooth.T @ path_m)
    rates_hz = np.arange(max(2 / lasts_s, _SLOWEST_WOBBLE_HZ), _FASTEST_WOBBLE_HZ, 0.1 / lasts_s)
    of_beat = np.abs(rates_hz[:, None] - hz * np.arange(1, HARMONICS + 1)).min(axis=1) < 1 / lasts_s
    best, amplitude_m, found_hz = 0.0, 0.0, 0.0
    for rate_hz in rates_hz[~of_beat]:
        wave = np.exp(2j * np.pi * rate_hz * time_s)
        pair = np.column_stack([wave.real, wave.imag])
        pair -= smooth @ (smooth.T @ pair)
        sizes, *_ = np.linalg.lstsq(pair, rest, rcond=None)
        explained = float(((pair @ sizes) ** 2).sum())
        if explained > best:
            best, amplitude_m, found_hz = explained, float(np.linalg.norm(sizes)), float(rate_hz)
    return amplitude_m, found_hz


def sight_flags(
    time_s: np.ndarray, span_px: np.ndarray, kept: np.ndarray, warm: np.ndarray, hz: float
) -> tuple[Flag, ...]:
    """Flag a picture whose scale drifts, and a fish that leaves it.

    Args:
        time_s: (n,) s.
        span_px: (n,) nose to neck in the picture, px; nan where not trusted.
        kept: (n,) frames that are compared.
        warm: (n,) frames after the warm-up, which would be compared if the head were seen in all.
        hz: beats a second.
    """
    flags = []
    shrinks, error = _drift(time_s, np.log(span_px), kept, hz)
    likely = max(_LIKELY_DRIFT, _LIKELY * error)
    if abs(shrinks) > min(likely, max(_SCALE_DRIFTS, _SURE * error)):
        about = "" if abs(shrinks) > _SURE * error else f" (standard error {100 * error:.1f} %)"
        message = (
            f"nose to neck {'grows' if shrinks > 0 else 'shrinks'} by {100 * abs(shrinks):.1f} %{about} from the first "
            "to the last compared frame: its lengths and speeds are no surer than that. Is the camera level and its "
            "lens calibrated?"
        )
        flags.append(Flag("scale_drifts", message=message))
    unseen_s = float(time_s[warm][-1] - time_s[kept][-1])
    if unseen_s > _UNSEEN_END_S:
        frames = int(np.flatnonzero(kept)[-1]) + 1, len(time_s) - 1
        message = f"nose and neck are not seen in the last {unseen_s:.1f} s, which are left out"
        flags.append(Flag("leaves_picture", frames=frames, message=message))
    return tuple(flags)


def creep_flags(markers: Sequence[str], aside_m: np.ndarray, length_m: float) -> tuple[Flag, ...]:
    """Flag the marker that slides farthest aside of the line through its neighbours, which a bend does not do.

    Args:
        markers: names of the m markers.
        aside_m: (m,) ways to the left of its neighbours, from the first to the last compared frame; 0 of those that
            are not judged.
        length_m: distance from nose to neck.
    """
    worst = int(np.argmax(np.abs(aside_m)))
    if abs(aside_m[worst]) <= _CREEP * length_m:
        return ()
    side = "left" if aside_m[worst] > 0 else "right"
    message = (
        f"{markers[worst]} slides {1000 * abs(aside_m[worst]):.0f} mm to the {side} of its neighbours from the first "
        "to the last compared frame, which no bend of the body does: did its tracker or the marker creep? The trial "
        "counts as it is"
    )
    return (Flag(CREEPS, (markers[worst],), message=message),)


def unread_flags(names: Sequence[str], read: np.ndarray, seen: np.ndarray, frames: int) -> tuple[Flag, ...]:
    """Flag markers that are seen too little, or at too few phases of the beat, to take part in a fit.

    Args:
        names: names of the m markers.
        read: (m,) whether each is read.
        seen: (m,) number of frames in which each is seen.
        frames: number of frames that are compared.
    """
    return tuple(
        Flag(
            "unread_marker",
            message=f"{name} is usable in {int(count)} of {frames} compared frames, too few or at too few phases of "
            "the beat to tell how it moves: it takes no part",
        )
        for name, good, count in zip(names, read, seen, strict=True)
        if not good
    )


def _drift(time_s: np.ndarray, series: np.ndarray, kept: np.ndarray, hz: float) -> tuple[float, float]:
    """Return the change of a series (n,) over the kept frames, less its beat, and its standard error.

    Where it is hardly seen both are 0.
    """
    used = kept & np.isfinite(series)
    if used.sum() < 12:
        return 0.0, 0.0
    beats = float(np.ptp(time_s[used])) * hz
    columns = design(time_s[used], hz, 2 if beats >= 1 else 0)
    found = np.linalg.lstsq(columns, series[used], rcond=None)[0]
    left = series[used] - columns @ found
    lasts = max(_LASTS, correlated_frames(left))
    error = float(np.sqrt(12 * lasts / used.sum()) * left.std())  # standard error of a line's rise over its own span
    longer = float(np.ptp(time_s[kept]) / np.ptp(time_s[used]))
    return float(found[1]) * longer, error * longer
