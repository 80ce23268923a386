"""A measured swim, ready to be compared with the twin: head frame, weights, frequency, start, scored frames.

The role of a `MeasuredTrial`, which `fitting.measure_trial` makes, decides what may be known of it and what is scored
(`in_role`): all of a fit trial, after its warm-up; of a held-out trial only what follows its first two beats.
`ExperimentsInAir` holds the dry runs of a session, measured as swims are, and its free decays.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import xarray as xr

from fitting.free_decay import DecayTrial
from fitting.frequency import SwimFrequency, estimate_frequency
from fitting.motor_clock import MotorRecord
from fitting.pool import (
    CommonScale,
    design,
    determined,
    forward_speed,
    head_frame,
    smooth_swim,
    weighted_fit,
)
from swimcal.errors import NotEnoughData
from swimcal.flags import Flag
from swimcal.runs import CrankTurn
from swimcal.tracks import by_marker, markers_of
from tracking.head_frame import HeadFrame, bridge_head

Beat = Callable[[np.ndarray], SwimFrequency]
"""Function that returns the frequency of some frames (n,)."""

FIRST_BEATS = 1.2  # beats of the command from which a held-out trial's frequency is first estimated
KNOWN_BEATS = 2.0  # beats of a held-out trial that may set its own frequency, phase and start
HARMONICS = 3
"""Number of harmonics of a beat that are read for every marker."""
_DEGREES = (3, 2)  # degrees of the smooth path and heading
_OF_SHORT = (1, 1)  # the same in a short window
_SHORT_BEATS = 1.5  # beats below which a window is short
_WELL_SEEN = 0.9  # share of the compared frames from which on it is not the markers that are lacking
_BRIDGED = 0.25  # least share of the scored frames with nose and neck, so that what is between is bridged
_LEAST_FRAMES = 29  # least compared frames: twice what a path, its harmonics and noise need, and one
_AND_KNOWN = {"fit": "", "holdout": " and the first beats of a held-out trial"}  # what else is not compared, by role
_FRAMES_A_BEAT = 2 * HARMONICS + 1  # least frames of a beat
SCORED_S = 4.0  # time of each trial after warm-up over which the published distance is taken


@dataclass(frozen=True, eq=False)
class MeasuredTrial:
    """One swim as measured.

    What is not seen takes no part. A frame counts where nose and neck are trusted (the marker error bridges them), and
    the compared frames end with the last such frame. A marker that these show too rarely, or at too few phases of the
    beat, has no weight in them.

    With a motor log whose clock is known only the frames of the steady drive are here, and the crank makes its measured
    turn, unless the tail beats otherwise: then it is another trial's log. The turn is an input, like a command: in a
    held-out trial it is used over the scored part too.

    Attributes:
        tracks: n frames of m markers, time from the first frame, as `swimcal.tracks` has them and with the variables
            ``weight`` (time, keypoint), 0 where a sample is flagged, missing, or its frame has no trusted head;
            ``own_weight`` (time, keypoint), the same whatever its frame's head;
            ``position_pool`` (time, space, keypoint), m, on the pool, right-handed seen from above; and of the
            published normaliser ``position_head`` (time, space, keypoint), m, relative to the nose, ``path`` (time,
            space), m, the nose's displacement, ``heading`` (time), rad, nan where nose or neck is not trusted, and
            ``nose`` (time, space), m, on the pool, bridged there. Attribute: ``metres_per_px``.
        frequency: frequency over the whole trial; with a turn its mean, else the tail's beat.
        start_frequency: frequency over the known part only; the same for a fit trial.
        start_velocity: (3,) velocity of the head at time 0 in its own axes (m/s, m/s, rad/s), from the known part.
        known: (n,) frames that may set the trial's own numbers.
        kept: (n,) frames compared: after warm-up, and for held-out trials after the known part.
        scored: (n,) the first 4 s from the aligned frame, at most to the last kept one.
        speed: forward speed over the whole beats of the kept frames, m/s.
        warmup_s: time left out of every comparison, even of a drive known to be steady: the twin has to settle.
        tail: indices of the markers behind the head, from head to fin.
        first_frame: the number of the first frame in the tracks it was measured from.
        motor: record of the motor; None without a log.
        turn: turn of the crank, from time 0; None where it is taken to turn evenly.
        beat: beat of the tail, over the whole trial.
        logged_hz: turns a second of the crank while it was driven, by its motor's log and clock; None without a log, or
            with one that may be another trial's.
        scale: the scale that the session's swims have in common; None where nose and neck of this one alone give it.
        scale_length_m: distance from nose to neck by the session, which the scale goes by; None for the robot's own.
    """

    name: str
    role: str
    commanded_hz: float | None
    tracks: xr.Dataset
    frequency: SwimFrequency
    start_frequency: SwimFrequency
    start_velocity: np.ndarray
    known: np.ndarray
    kept: np.ndarray
    scored: np.ndarray
    speed: float
    warmup_s: float
    tail: tuple[int, ...]
    flags: tuple[Flag, ...]
    first_frame: int = 0
    motor: MotorRecord | None = None
    turn: CrankTurn | None = None
    beat: SwimFrequency | None = None
    logged_hz: float | None = None
    scale: CommonScale | None = None
    scale_length_m: float | None = None

    def __repr__(self) -> str:
        size = f"{len(self.markers)} markers, {len(self.time_s)} frames"
        motion = f"{self.frequency.hz:.3f} Hz, {1000 * self.speed:.1f} mm/s"
        return f"<MeasuredTrial {self.name}: {self.role}, {motion}, {size}>"

    @cached_property
    def markers(self) -> tuple[str, ...]:
        """Names of the m markers."""
        return markers_of(self.tracks)

    @cached_property
    def time_s(self) -> np.ndarray:
        """Times from the first frame, (n,), s."""
        return np.asarray(self.tracks.time.values)

    @cached_property
    def position_m(self) -> np.ndarray:
        """Positions (n, m, 2) on the pool, right-handed seen from above, m."""
        return by_marker(self.tracks.position_pool)

    @cached_property
    def head(self) -> HeadFrame:
        """Markers in the head frame."""
        shape_m, path_m = by_marker(self.tracks.position_head), self.tracks.path.values
        nose_m, heading_rad = self.tracks.nose.values, self.tracks.heading.values
        moved_m = bridge_head(shape_m + path_m[:, None], self.position_m, nose_m, heading_rad, path_m)
        return HeadFrame(moved_m, shape_m, path_m, heading_rad, nose_m)

    @cached_property
    def head_seen(self) -> np.ndarray:
        """Return whether nose and neck are trusted in each frame, (n,)."""
        return np.isfinite(self.tracks.heading.values)

    def seen_head(self, position_m: np.ndarray) -> HeadFrame:
        """Turn simulated markers (..., k, m, 2) of the first k frames into the head frame, with this trial's gaps.

        A simulation that diverges on the way is nan throughout: no gap is to hide that.
        """
        stands = np.isfinite(position_m).all(axis=(-3, -2, -1), keepdims=True)
        whole = np.where(stands, position_m, np.nan)
        return head_frame(self.markers, whole, self.head_seen[: position_m.shape[-3]])

    @cached_property
    def own_weight(self) -> np.ndarray:
        """Weight of each sample, (n, m), whether or not nose and neck are trusted in its frame."""
        return np.asarray(self.tracks.own_weight.values)

    @cached_property
    def weight(self) -> np.ndarray:
        """Weight of each sample, (n, m); 0 where it does not count, or nose and neck are not trusted."""
        return np.asarray(self.tracks.weight.values)

    @property
    def aligned(self) -> int:
        """Index of the frame in which twin and trial are laid on one another for the marker error.

        It is the first that may be compared. If nose or neck is missing there, both are bridged alike from frames
        before and after; without a frame before, or with few in the time that is scored, it is the first that is kept.
        """
        first = int(np.flatnonzero(_may_be_compared(self.role, self.time_s, self.warmup_s, self.known))[0])
        scored = (self.time_s >= self.time_s[first]) & (self.time_s < self.time_s[first] + SCORED_S)
        bridges = self.head_seen[: first + 1].any() and self.head_seen[scored].mean() >= _BRIDGED
        return first if bridges else int(np.flatnonzero(self.kept)[0])

    @property
    def hindmost(self) -> int:
        """Index of the last tail marker that is seen in kept frames."""
        seen = self.weight[self.kept].any(axis=0)
        return [marker for marker in self.tail if seen[marker]][-1]

    @property
    def metres_per_px(self) -> float:
        """Scale of the picture."""
        return float(self.tracks.metres_per_px)

    def seen_as(
        self,
        *,
        position_m: np.ndarray | None = None,
        head: HeadFrame | None = None,
        weight: np.ndarray | None = None,
    ) -> MeasuredTrial:
        """Return the same trial with other places on the pool, in the head frame, or other weights.

        Args:
            position_m: (n, m, 2) places on the pool, m.
            head: the head frame.
            weight: (n, m) weights.
        """
        place = self.position_m if position_m is None else position_m
        other = head or self.head, self.own_weight if weight is None else weight
        return replace(self, tracks=laid_on_pool(self.tracks, place, *other, self.metres_per_px))

    def crank_rad(self, time_s: np.ndarray, frequency_hz: float) -> np.ndarray:
        """Return the angle (k,) that the crank has turned since time 0, rad.

        Args:
            time_s: (k,) times.
            frequency_hz: turns a second without a measured turn.
        """
        return 2 * np.pi * frequency_hz * time_s if self.turn is None else self.turn.angle(time_s)

    def with_role(self, role: str) -> MeasuredTrial:
        """Return the same trial fitted or held out instead: what is known of it and what is scored change with that.

        Raises:
            NotEnoughData: held out, it leaves too few frames to score.
        """
        return self if role == self.role else in_role(self, role)

    @property
    def filmed_hz(self) -> float:
        """Beats a second of the tail on the camera's clock, whatever a motor's log says, Hz."""
        return (self.beat or self.frequency).hz

    def rows_of(self, flag: Flag) -> slice:
        """Return the rows of this trial's arrays that a flag concerns; its frames count from the recording's first."""
        if flag.frames is None:
            return slice(0, len(self.weight))
        first, last = flag.frames
        return slice(max(first - self.first_frame, 0), max(last + 1 - self.first_frame, 0))

    def weight_of(self, frames: int) -> np.ndarray:
        """Return the weights (frames, m) in the tracks it was measured from; 0 before and after its own n frames."""
        return np.pad(self.weight, ((self.first_frame, frames - self.first_frame - len(self.weight)), (0, 0)))

    @property
    def used_fraction(self) -> float:
        """Share of the kept samples that count."""
        return float((self.weight[self.kept] > 0).mean())


def laid_on_pool(
    tracks: xr.Dataset, position_m: np.ndarray, head: HeadFrame, weight: np.ndarray, metres_per_px: float
) -> xr.Dataset:
    """Add places on the pool and in the head frame to tracks, as `MeasuredTrial.tracks` has them.

    Args:
        tracks: n frames of m markers.
        position_m: (n, m, 2) on the pool, m.
        head: the head frame.
        weight: (n, m) weights, whatever the head of their frame.
        metres_per_px: scale of the picture.
    """
    metres, places = {"units": "m"}, ("time", "space", "keypoint")
    on_pool, in_head = "position on the pool", "position in the frame of the head"
    variables = {
        "weight": (("time", "keypoint"), weight * np.isfinite(head.heading_rad)[:, None]),
        "own_weight": (("time", "keypoint"), weight),
        "position_pool": (places, np.swapaxes(position_m, 1, 2), metres | {"long_name": on_pool}),
        "position_head": (places, np.swapaxes(head.shape_m, 1, 2), metres | {"long_name": in_head}),
        "path": (("time", "space"), head.path_m, metres),
        "nose": (("time", "space"), head.nose_m, metres),
        "heading": (("time",), head.heading_rad, {"units": "rad"}),
    }
    return tracks.assign(variables).assign_attrs(metres_per_px=metres_per_px)


def degrees_of(turn_rad: np.ndarray) -> tuple[int, int]:
    """Return the degrees in time of the smooth path and heading over a crank's turn (n,), rad.

    Those of a short window are 1: a cubic cannot be told from a single beat.
    """
    return _DEGREES if np.ptp(turn_rad) >= 2 * np.pi * _SHORT_BEATS else _OF_SHORT


def of_crank(
    beat: SwimFrequency, turn: CrankTurn | None, motor: MotorRecord | None, time_s: np.ndarray
) -> SwimFrequency:
    """Return the beat with the mean turn of the crank over its frames (n,) for its frequency, if that was measured."""
    if turn is None or motor is None:
        return beat
    hz = turn.mean_hz(float(time_s[0]), float(time_s[-1]))
    return replace(beat, hz=hz, se_hz=hz * motor.clock.rate_se, beats=hz * float(np.ptp(time_s)))


def beats_seen(trial: MeasuredTrial, frames: np.ndarray) -> float:
    """Return how many beats of the known frequency these frames (n,) show with nose and neck."""
    frame_s = float(np.median(np.diff(trial.time_s)))
    return float(trial.start_frequency.hz * frame_s * (trial.head_seen & frames).sum())


def in_role(trial: MeasuredTrial, role: str) -> MeasuredTrial:
    """Return the trial with what is known of it and what is scored in this role."""
    time_s, head, tail = trial.time_s, trial.head, list(trial.tail)

    def beat(frames: np.ndarray) -> SwimFrequency:
        lateral = head.shape_m[frames][:, tail, 1]
        found = estimate_frequency(time_s[frames], lateral, trial.weight[frames][:, tail], trial.commanded_hz)
        return of_crank(found, trial.turn, trial.motor, time_s[frames])

    known = _find_known(role, trial.commanded_hz, time_s, trial.head_seen, beat)
    start_frequency = trial.frequency if known.all() else _beat_of_part(beat, known, trial)
    kept = _find_kept(role, trial, known)
    found = replace(
        trial,
        role=role,
        start_frequency=start_frequency,
        start_velocity=_start_velocity(time_s[known], head.path_m[known], head.heading_rad[known], start_frequency.hz),
        known=known,
        kept=kept,
        speed=float(forward_speed(time_s, head, kept, trial.frequency.hz)),
    )
    last = int(np.flatnonzero(kept)[-1])
    _check_start(found)
    scored = _may_be_compared(role, time_s, trial.warmup_s, known) & (np.arange(len(time_s)) <= last)
    scored &= (np.arange(len(time_s)) >= found.aligned) & (time_s < time_s[found.aligned] + SCORED_S - 1e-9)
    return _drop_unread(replace(found, scored=scored))


def _check_start(trial: MeasuredTrial) -> None:
    """Check that a held-out trial shows its head for a beat where its start and its phase are read.

    Raises:
        NotEnoughData: it does not.
    """
    first = trial.known & (trial.time_s <= KNOWN_BEATS / trial.start_frequency.hz + 1e-9)
    beats = beats_seen(trial, first)
    if trial.role != "fit" and not trial.head_seen[first].all() and beats < 1.0:
        raise NotEnoughData(
            f"trial {trial.name}: the part of a held-out trial that may be looked at begins with {beats:.1f} beats "
            "that show nose and neck; at least one is needed"
        )


def _find_known(
    role: str, commanded_hz: float | None, time_s: np.ndarray, head_seen: np.ndarray, beat: Beat
) -> np.ndarray:
    """Return the frames (n,) that are known: all of a fit trial; the first two beats of a held-out one, at most half.

    The length of two beats is not found from later frames either: the known part grows, from a little over one beat of
    the command, until it holds two beats of its own. Frames without nose and neck show no beat: it grows by them too.
    """
    if role == "fit":
        return np.ones(len(time_s), bool)
    half, frame_s = time_s[-1] / 2, float(np.median(np.diff(time_s)))

    def until_seen(needed_s: float) -> float:
        end = needed_s
        while end < half:
            unseen = frame_s * int((~head_seen & (time_s < end + 1e-9)).sum())
            if needed_s + unseen <= end + 1e-9:
                return end
            end = needed_s + unseen
        return float(half)

    end = until_seen(FIRST_BEATS / commanded_hz) if commanded_hz else half
    while end < half:
        try:
            needed = until_seen(KNOWN_BEATS / beat(time_s < end + 1e-9).hz)
        except NotEnoughData:
            needed = 1.25 * end
        if needed < end + frame_s:
            break
        end = min(needed, half)
    return time_s < end + 1e-9


def _find_kept(role: str, trial: MeasuredTrial, known: np.ndarray) -> np.ndarray:
    """Return the compared frames (n,).

    They come after the warm-up and a held-out trial's known part, between the first and last frame with a head.
    """
    time_s, warmup_s = trial.time_s, trial.warmup_s
    kept = _may_be_compared(role, time_s, warmup_s, known)
    seen = np.flatnonzero(kept & trial.head_seen)
    if len(seen):
        kept[: seen[0]], kept[seen[-1] + 1 :] = False, False
    if len(seen) < _LEAST_FRAMES:
        raise NotEnoughData(
            f"trial {trial.name}: {time_s[-1]:.2f} s leave {len(seen)} frames with nose and neck after {warmup_s:g} s "
            f"of warm-up{_AND_KNOWN[role]}; at least {_LEAST_FRAMES} are needed: shorten [fit] warmup_s or record "
            f"longer{_lost_frames(trial)}"
        )
    a_beat = 1 / (trial.frequency.hz * float(np.median(np.diff(time_s))))
    if a_beat < _FRAMES_A_BEAT:
        raise NotEnoughData(
            f"trial {trial.name}: {a_beat:.1f} frames a beat of {trial.frequency.hz:.3g} Hz; at least {_FRAMES_A_BEAT} "
            "are needed: film it with more frames a second"
        )
    return kept


def _lost_frames(trial: MeasuredTrial) -> str:
    """Tell which faults of the whole picture took frames from a trial; empty without any."""
    faults = [flag.message for flag in trial.flags if flag.message and len(flag.markers) == len(trial.markers)]
    return f". Frames are lost as {'; '.join(faults)}" if faults else ""


def _may_be_compared(role: str, time_s: np.ndarray, warmup_s: float, known: np.ndarray) -> np.ndarray:
    """Tell which frames (n,) may be compared: after the warm-up, and after a held-out trial's known part."""
    after = time_s >= warmup_s - 1e-9
    return after if role == "fit" else after & ~known


def _drop_unread(trial: MeasuredTrial) -> MeasuredTrial:
    """Take the weight from markers that the kept frames do not show well enough to be read.

    Raises:
        NotEnoughData: nose and neck, or all markers of the tail, are among them.
    """
    frames = trial.kept
    turn_rad = trial.crank_rad(trial.time_s[frames], trial.frequency.hz)
    columns = smooth_swim(trial.time_s[frames], turn_rad, degrees_of(turn_rad)[1], HARMONICS)
    read = determined(columns, (trial.weight[frames] > 0) & np.isfinite(trial.position_m[frames]).all(axis=-1))
    head = [trial.markers.index(name) for name in ("nose", "neck")]
    for needed, whose in ((read[head].all(), "nose and neck"), (read[list(trial.tail)].any(), "the tail")):
        if not needed:
            concerned = head if whose != "the tail" else list(trial.tail)
            usable = (trial.weight[frames][:, concerned] > 0).sum(axis=0)
            if usable.min() > _WELL_SEEN * frames.sum():
                raise NotEnoughData(
                    f"trial {trial.name}: too short: {int(frames.sum())} frames are left after {trial.warmup_s:g} s of "
                    f"warm-up{_AND_KNOWN[trial.role]}, too few for the harmonics of a beat. Record longer, or shorten "
                    f"[fit] warmup_s{_lost_frames(trial)}"
                )
            counts = ", ".join(
                f"{trial.markers[marker]} {count}" for marker, count in zip(concerned, usable.tolist(), strict=True)
            )
            raise NotEnoughData(
                f"trial {trial.name}: {whose} cannot be read: of {int(frames.sum())} compared frames usable are "
                f"{counts}, too few, or at too few phases of the beat. Track it again, or leave the trial out"
            )
    if read.all():
        return trial
    weight = np.where((frames | trial.scored)[:, None] & ~read, 0.0, trial.own_weight)
    return trial.seen_as(weight=weight)


def _beat_of_part(beat: Beat, known: np.ndarray, trial: MeasuredTrial) -> SwimFrequency:
    """Return the frequency of the known part of a held-out trial, found without a look at what is scored."""
    try:
        return beat(known)
    except NotEnoughData as problem:
        raise NotEnoughData(
            f"trial {trial.name}: the part of a held-out trial that may be looked at (two beats, at most half) is too "
            f"short{_lost_frames(trial) or f': {problem}. Record longer'}"
        ) from problem


def _start_velocity(time_s: np.ndarray, path_m: np.ndarray, heading_rad: np.ndarray, hz: float) -> np.ndarray:
    """Return the velocity (3,) of the head at time 0.

    It follows from a drift and two harmonics over the first two beats, at most.
    """
    first = time_s <= KNOWN_BEATS / hz + 1e-9
    seen = np.isfinite(heading_rad)[:, None]
    series = np.column_stack([np.where(seen, path_m, np.nan), heading_rad])[first]  # (k, 3)
    columns = design(time_s[first], hz, harmonics=2)
    c = weighted_fit(columns, series, np.isfinite(series).astype(float))
    angular = 2 * np.pi * hz
    return c[1] / max(float(np.ptp(time_s[first])), 1e-9) + angular * (c[3] + 2 * c[5])


class ExperimentsInAir(NamedTuple):
    """Runs with the head clamped, measured as swims are, and decays of a tail that is let go."""

    runs: Sequence[MeasuredTrial] = ()
    decays: Sequence[DecayTrial] = ()


NOTHING = ExperimentsInAir()
