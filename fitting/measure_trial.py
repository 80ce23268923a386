"""Measurement of a swim: checks, scale, head frame, frequency and flags, from its tracks and its motor's log."""

from dataclasses import replace

import numpy as np
import xarray as xr

from fitting.features import FeatureReader
from fitting.frequency import beating_part, estimate_frequency
from fitting.motor_clock import MotorRecord
from fitting.pool import head_frame, head_is_trusted, in_pool
from fitting.trial import KNOWN_BEATS, MeasuredTrial, beats_seen, in_role, laid_on_pool, of_crank
from fitting.trial_checks import (
    LEAST_OF_PART,
    check_beat,
    check_clock_and_scale,
    check_lasting,
    creep_flags,
    motion_flags,
    rate_flags,
    reach_along_tail,
    rest_flags,
    sight_flags,
    unread_flags,
)
from swimcal.errors import NotEnoughData
from swimcal.flags import Flag
from swimcal.robot import RobotSpec
from swimcal.session import TrialSpec
from swimcal.session_file import CameraSpec
from swimcal.tracks import markers_of


def measure_trial(
    spec: TrialSpec,
    tracks: xr.Dataset,
    camera: CameraSpec,
    robot: RobotSpec,
    warmup_s: float,
    motor: MotorRecord | None = None,
    judged: bool = True,
) -> MeasuredTrial:
    """Check, scale and normalise the tracks of one swim, and find its frequency, start and speed.

    Args:
        spec: the swim.
        tracks: all its frames.
        camera: the camera that filmed it.
        robot: the robot.
        warmup_s: time left out of every comparison.
        motor: record of the motor (`fitting.motor_clock.read_motor`); default: the crank turns evenly.
        judged: whether samples are checked; those of a simulation are right.

    Raises:
        NotEnoughData: no tail marker, too short for its warm-up, less than one beat, or a drive that was not filmed.
    """
    first_frame, tracks = (0, tracks) if motor is None else motor.driven(tracks, spec.name)
    recorded_s: np.ndarray = tracks.time.values
    if (lasts_s := float(recorded_s[-1] - recorded_s[0])) <= warmup_s:
        raise NotEnoughData(
            f"too short: it lasts {lasts_s:.3g} s, and its warm-up of {warmup_s:g} s is compared with nothing. Record "
            "longer, or shorten [fit] warmup_s"
        )
    rests: tuple[Flag, ...] = ()
    position_m, metres_per_px, quality, tail = in_pool(tracks, camera, robot, f"trial {spec.name}", judged=judged)
    reach = reach_along_tail(robot, [markers_of(tracks)[marker] for marker in tail])
    trusted = head_is_trusted(markers_of(tracks), quality.weight)
    head = head_frame(markers_of(tracks), position_m, trusted)
    own_weight = np.where(np.isfinite(position_m).all(axis=-1), quality.weight, 0.0)
    weight = own_weight * np.isfinite(head.heading_rad)[:, None]
    flags = check_clock_and_scale(recorded_s, camera, robot)
    beat = estimate_frequency(recorded_s - recorded_s[0], head.shape_m[:, tail, 1], weight[:, tail], spec.commanded_hz)
    check_beat(beat, robot, reach, LEAST_OF_PART)
    used = beating_part(recorded_s, head.shape_m[:, tail, 1], weight[:, tail], beat.hz)
    if used != slice(0, len(recorded_s)):
        check_lasting(recorded_s, used, beat)
        rests, tracks = rest_flags(recorded_s, used), tracks.isel(time=used)
        position_m, weight, trusted, own_weight = position_m[used], weight[used], trusted[used], own_weight[used]
        head = head_frame(markers_of(tracks), position_m, trusted)
        time_s = tracks.time.values - tracks.time.values[0]
        beat = estimate_frequency(time_s, head.shape_m[:, tail, 1], weight[:, tail], spec.commanded_hz)
    time_s = tracks.time.values - tracks.time.values[0]
    check_beat(beat, robot, reach)
    motor = None if motor is None else motor.against(beat, tracks.time.values)
    turn = motor.turn.shifted(float(tracks.time.values[0])) if motor is not None and motor.usable else None
    frequency = of_crank(beat, turn, motor, time_s)
    pace = () if turn is not None else rate_flags(time_s, head.shape_m[:, tail, 1], weight[:, tail], beat.hz)
    of_frames = (*quality.flags, *flags, *rests, *beat.flags, *pace)
    every_frame = np.ones(len(time_s), bool)
    trial = MeasuredTrial(
        name=spec.name,
        role="fit",
        commanded_hz=spec.commanded_hz,
        tracks=laid_on_pool(tracks.assign_coords(time=time_s), position_m, head, own_weight, metres_per_px),
        frequency=frequency,
        start_frequency=frequency,
        start_velocity=np.zeros(3),
        known=every_frame,
        kept=every_frame,
        scored=every_frame,
        speed=np.nan,
        warmup_s=warmup_s,
        tail=tuple(tail),
        flags=(*(flag.later(first_frame) for flag in of_frames), *(motor.flags if motor else ())),
        first_frame=first_frame + used.start,
        motor=motor,
        turn=turn,
        beat=beat,
        logged_hz=None if motor is None else motor.logged_hz,
        scale_length_m=camera.scale_length_m,
    )
    return _add_flags(in_role(trial, spec.role), weight > 0, robot)


def _add_flags(trial: MeasuredTrial, usable: np.ndarray, robot: RobotSpec) -> MeasuredTrial:
    """Flag the faults of the trial as a whole, in the frames that are compared; usable (n, m) samples."""
    nose, neck = (trial.markers.index(name) for name in ("nose", "neck"))
    span_m = np.linalg.norm(trial.position_m[:, neck] - trial.position_m[:, nose], axis=1)
    span_px = np.where(trial.head_seen, span_m, np.nan) / trial.metres_per_px
    warm = (trial.time_s >= trial.warmup_s - 1e-9) & (np.arange(len(trial.time_s)) < _cut_after(trial))
    length_m = float(np.nanmedian(np.where(trial.head_seen, span_m, np.nan)))
    moves = motion_flags(trial.time_s, trial.head, trial.kept, trial.speed, trial.frequency.hz, length_m)
    sight = sight_flags(trial.time_s, span_px, trial.kept, warm, trial.frequency.hz)
    read, counts = trial.weight[trial.kept].any(axis=0), (usable[trial.kept] > 0).sum(axis=0)
    unread = unread_flags(trial.markers, read, counts, int(trial.kept.sum()))
    found = (*moves, *sight, *unread, *_flag_creep(trial, robot, length_m), *_flag_known(trial))
    return replace(trial, flags=(*trial.flags, *(flag.later(trial.first_frame) for flag in found)))


def _flag_creep(trial: MeasuredTrial, robot: RobotSpec, length_m: float) -> tuple[Flag, ...]:
    """Flag a marker that slides aside of its neighbours; nothing is told where too few frames show the head."""
    try:
        reader = FeatureReader.of(trial)
    except NotEnoughData:
        return ()
    creeps = reader.creeps(trial.position_m[trial.kept], robot.marker_positions_m(trial.markers)[:, 0])
    return creep_flags(trial.markers, creeps * np.ptp(reader.time_s), length_m)


def _flag_known(trial: MeasuredTrial) -> tuple[Flag, ...]:
    """Flag a held-out trial whose known part misses a head in some frames, and shows fewer than two beats."""
    found = trial.start_frequency
    beats = beats_seen(trial, trial.known)
    if trial.head_seen[trial.known].all() or beats >= KNOWN_BEATS - 0.05:
        return ()
    message = (
        f"before the scored part only {beats:.1f} beats show nose and neck: {found.hz:.3f} Hz from them is uncertain"
    )
    return (Flag("few_beats", message=message),)


def _cut_after(trial: MeasuredTrial) -> int:
    """Return the frame from which on nothing counts, as the body jumps or the film stood still; or their number."""
    last = int(np.flatnonzero(trial.kept)[-1])
    whole = [
        flag.frames
        for flag in trial.flags
        if flag.kind in ("jump", "frozen_marker") and len(flag.markers) == len(trial.markers)
    ]
    since = [first - trial.first_frame for first, _ in filter(None, whole)]
    return min([frame for frame in since if frame > last], default=len(trial.kept))
