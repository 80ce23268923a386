"""Disturbances that happen in laboratories: in the pool, before the camera, in the tracker, and in its file."""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from benchmarks.foreign.recordings import Recording, Recordings

Change = Callable[[Recordings, Recording, np.random.Generator], str]
"""Function that disturbs a session, mostly one trial of it, and returns in words how."""
FASTER_HZ = (5.0, 8.0)
FAST_S = 5.0
MOST = 3  # One session has at most this many disturbances.


class Disturbance(NamedTuple):
    """Kind of disturbance; `of` says which trials it can befall."""

    change: Change
    in_pool: bool = False  # it happens before the camera films
    of: Callable[[Recordings, Recording], bool] = lambda _session, trial: trial.kind == "swim"

    @property
    def name(self) -> str:
        """Name as tables have it."""
        return self.change.__name__


def disturb(session: Recordings, number: int, random: np.random.Generator) -> None:
    """Disturb the session of this number and film it; every third stays clean, the others go round all kinds."""
    chosen: list[Disturbance] = []
    if number % 3:
        more = random.choice(len(KINDS), int(random.integers(0, MOST)), replace=False)
        chosen = list(dict.fromkeys([KINDS[(number - number // 3 - 1) % len(KINDS)], *(KINDS[i] for i in more)]))
    for in_pool in (True, False):
        for kind in (kind for kind in chosen if kind.in_pool == in_pool):
            apply(session, kind, random)
        if in_pool:
            for trial in session.trials:
                trial.film(session.fps, session.tracker, random, session.varied)


def apply(session: Recordings, kind: Disturbance, random: np.random.Generator) -> None:
    """Apply one disturbance to a trial that it can befall; do nothing where there is none."""
    able = [trial for trial in session.trials if kind.of(session, trial)]
    if able:
        trial = able[int(random.integers(len(able)))]
        detail = kind.change(session, trial, random)
        trial.touched = True
        session.disturbances.append(f"{kind.name}: {trial.name}, {detail}")


# In the pool


def rests_first(session: Recordings, trial: Recording, random: np.random.Generator) -> str:  # noqa: ARG001
    """Let the robot lie still, then swim."""
    seconds = float(random.uniform(1.0, 3.0))
    _pause(trial, 0.0, seconds)
    trial.said = trial.said or "it rests at first"
    return f"rests for {seconds:.1f} s, then swims"


def rests(session: Recordings, trial: Recording, random: np.random.Generator) -> str:  # noqa: ARG001
    """Leave the motor off."""
    trial.pool_px = np.repeat(trial.pool_px[:1], len(trial.pool_px), axis=0)
    trial.like_twin, trial.steady, trial.said = False, False, "it rests"
    _allow_refusal(session, trial)
    return "rests throughout"


def stops(session: Recordings, trial: Recording, random: np.random.Generator) -> str:  # noqa: ARG001
    """Stop the robot for a while in the middle."""
    seconds, at = float(random.uniform(1.0, 3.0)), float(random.uniform(0.3, 0.7)) * trial.pool_s[-1]
    _pause(trial, at, seconds)
    trial.said = trial.said or "it stops"
    return f"stands still for {seconds:.1f} s at {at:.1f} s"


def current(session: Recordings, trial: Recording, random: np.random.Generator) -> str:
    """Carry the robot with the water: the net velocity times a factor. -1: backwards, 0: it beats on the spot."""
    factor = float(random.choice([-1.0, 0.0, 0.5, 1.5]))
    nose, _ = session.head
    velocity = np.polyfit(trial.pool_s, trial.pool_px[:, nose], 1)[0]
    trial.pool_px = trial.pool_px + ((factor - 1.0) * trial.pool_s[:, None] * velocity)[:, None, :]
    trial.like_twin = False
    if factor <= 0.0 and trial.role == "fit":
        trial.said = trial.said or "no such robot swims so"
    return f"carried along: {factor:g} times its net velocity"


def turns(session: Recordings, trial: Recording, random: np.random.Generator) -> str:
    """Bend the whole swim to one side."""
    rate = np.radians(float(random.choice([-1, 1]) * random.uniform(5.0, 40.0)))
    nose, _ = session.head
    turned = np.exp(1j * rate * trial.pool_s)
    place = trial.pool_px[..., 0] + 1j * trial.pool_px[..., 1]
    steps = np.diff(place[:, nose]) * (turned[1:] + turned[:-1]) / 2
    path = place[0, nose] + np.append(0.0, np.cumsum(steps))
    place = path[:, None] + turned[:, None] * (place - place[:, nose : nose + 1])
    trial.pool_px, trial.like_twin = np.stack([place.real, place.imag], axis=-1), False
    return f"turns by {np.degrees(rate):.0f} degrees a second"


def scale_drifts(session: Recordings, trial: Recording, random: np.random.Generator) -> str:  # noqa: ARG001
    """Let the robot near the camera or sink: the picture grows or shrinks."""
    trial.growth = float(random.choice([-1, 1]) * random.uniform(0.01, 0.08))
    return f"the picture grows by {100 * trial.growth:.1f} %"


def beats_fast(session: Recordings, trial: Recording, random: np.random.Generator) -> str:  # noqa: ARG001
    """Repeat the same motion at several times the speed, as far per beat."""
    factor, step = float(random.uniform(*FASTER_HZ)) / trial.hz, trial.pool_s[1] - trial.pool_s[0]
    beats = int(np.ptp(trial.pool_s) * trial.hz)
    whole = round(beats / trial.hz / step)
    ahead = (trial.pool_px[whole] - trial.pool_px[0]).mean(axis=0)
    again = range(int(np.ceil(factor * FAST_S / (whole * step))))
    trial.pool_px = np.concatenate([trial.pool_px[:whole] + i * ahead for i in again])
    trial.pool_s = np.arange(len(trial.pool_px)) * step / factor
    trial.hz, trial.like_twin = beats / (whole * step) * factor, False
    trial.commanded_hz = trial.hz
    return f"beats at {trial.hz:.2f} Hz"


def frames_uneven(session: Recordings, trial: Recording, random: np.random.Generator) -> str:  # noqa: ARG001
    """Vary the frame rate; the time stamps say so."""
    session.varied = float(random.uniform(0.05, 0.4))
    return f"in all trials frames are up to {100 * session.varied:.0f} % early or late, as stamped"


# Unseen


def tail_gap(session: Recordings, trial: Recording, random: np.random.Generator) -> str:
    """Hide a tail marker for a while."""
    return _hide(session, trial, [int(random.choice(session.tail))], *_draw_stretch(trial, 0.2, 0.6, random))


def tail_never_compared(session: Recordings, trial: Recording, random: np.random.Generator) -> str:
    """Show a tail marker in the warm-up alone."""
    marker = int(random.choice(session.tail))
    if len(session.tail) == 1:
        _allow_refusal(session, trial)
    return _hide(session, trial, [marker], 0.8 * session.warmup_s, np.inf)


def tail_in_few_frames(session: Recordings, trial: Recording, random: np.random.Generator) -> str:
    """Show a tail marker in a few frames in a row."""
    marker, frames = int(random.choice(session.tail)), int(random.integers(2, 13))
    first = int(random.integers(0, max(len(trial.time_s) - frames, 1)))
    numbers = np.arange(len(trial.time_s))
    trial.empty([marker], (numbers < first) | (numbers >= first + frames))
    if len(session.tail) == 1:
        _allow_refusal(session, trial)
    return f"{session.markers[marker]} seen in {frames} frames from {first}"


def tail_on_one_side(session: Recordings, trial: Recording, random: np.random.Generator) -> str:
    """Hide a tail marker whenever it is to the left of the body."""
    marker, (nose, neck) = int(random.choice(session.tail)), session.head
    axis, arm = trial.xy[:, neck] - trial.xy[:, nose], trial.xy[:, marker] - trial.xy[:, nose]
    trial.empty([marker], axis[:, 0] * arm[:, 1] > axis[:, 1] * arm[:, 0])
    return f"{session.markers[marker]} hidden on one side"


def head_gap(session: Recordings, trial: Recording, random: np.random.Generator) -> str:
    """Hide nose or neck for a while."""
    return _hide(session, trial, [int(random.choice(session.head))], *_draw_stretch(trial, 0.2, 0.5, random))


def head_in_first_beats(session: Recordings, trial: Recording, random: np.random.Generator) -> str:
    """Hide nose or neck in the first two beats, but for the first frame."""
    if trial.role == "holdout":
        _allow_refusal(session, trial)
    return _hide(session, trial, [int(random.choice(session.head))], 1e-9, 2.05 / trial.hz)


def all_gap(session: Recordings, trial: Recording, random: np.random.Generator) -> str:
    """Hide everything for a second."""
    start = float(random.uniform(0.3, 0.6)) * trial.time_s[-1]
    return _hide(session, trial, range(len(session.markers)), start, start + 1.0)


def leaves(session: Recordings, trial: Recording, random: np.random.Generator) -> str:
    """Let the robot leave the picture, marker by marker: rows are empty from then on."""
    end, (nose, _) = float(random.uniform(0.6, 0.9)), session.head
    way = trial.xy[int(end * len(trial.xy)), nose] - trial.xy[0, nose]
    gone = (trial.xy - trial.xy[int(end * len(trial.xy)), nose]) @ way > 0.0
    trial.xy[np.maximum.accumulate(gone, axis=0)] = np.nan
    return f"leaves the picture after {100 * end:.0f} %"


def blank_once_held_out(session: Recordings, trial: Recording, random: np.random.Generator) -> str:  # noqa: ARG001
    """Hide all of a held-out trial after its first two beats."""
    trial.steady, trial.said = False, "nothing of it is compared"
    _allow_refusal(session, trial)
    return _hide(session, trial, range(len(session.markers)), max(2.0 / trial.hz, session.warmup_s), np.inf)


# Wrong in the tracker


def confidence_low(session: Recordings, trial: Recording, random: np.random.Generator) -> str:  # noqa: ARG001
    """Lower the tracker's confidence everywhere."""
    trial.sure = random.uniform(0.02, 0.6, trial.sure.shape)
    return "confidences of 0.02 to 0.6"


def confidence_empty(session: Recordings, trial: Recording, random: np.random.Generator) -> str:
    """Empty cells of confidence."""
    trial.sure[random.random(trial.sure.shape) < float(random.choice([0.1, 1.1]))] = np.nan
    session.refusable = True
    return f"{np.isnan(trial.sure).sum()} confidences empty"


def tail_swapped(session: Recordings, trial: Recording, random: np.random.Generator) -> str:
    """Exchange two neighbours of the tail for a while."""
    start, end = _draw_stretch(trial, 0.05, 0.25, random)
    place = int(random.integers(len(session.tail) - 1))
    one, two = session.tail[place : place + 2]
    _exchange(trial, one, two, (trial.time_s >= start) & (trial.time_s < end))
    return f"{session.markers[one]} and {session.markers[two]} exchanged from {start:.1f} to {end:.1f} s"


def tail_misplaced(session: Recordings, trial: Recording, random: np.random.Generator) -> str:
    """Place the box of a tail marker 30 mm off it."""
    marker, angle = int(random.choice(session.tail)), float(random.uniform(0.0, 2 * np.pi))
    axis = trial.xy[:, session.head[1]] - trial.xy[:, session.head[0]]
    along = axis / np.linalg.norm(axis, axis=1, keepdims=True)
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    trial.xy[:, marker] += 0.03 * session.px_per_m * (np.cos(angle) * along + np.sin(angle) * across)
    return f"{session.markers[marker]} 30 mm off at {np.degrees(angle):.0f} degrees"


def head_exchanged(session: Recordings, trial: Recording, random: np.random.Generator) -> str:  # noqa: ARG001
    """Exchange nose and neck throughout."""
    _exchange(trial, *session.head, np.ones(len(trial.time_s), bool))
    trial.like_twin = False
    _allow_refusal(session, trial)
    return "nose and neck exchanged"


def frozen(session: Recordings, trial: Recording, random: np.random.Generator) -> str:
    """Freeze a marker where it is for a while."""
    marker, (start, end) = int(random.integers(len(session.markers))), _draw_stretch(trial, 0.1, 0.4, random)
    frames = np.flatnonzero((trial.time_s >= start) & (trial.time_s < end))
    trial.xy[frames, marker] = trial.xy[frames[0], marker]
    return f"{session.markers[marker]} frozen from {start:.1f} to {end:.1f} s"


# Wrong in the clock


def stamps_jitter(session: Recordings, trial: Recording, random: np.random.Generator) -> str:
    """Put time stamps off by up to 40 % of a frame; the frames are not."""
    off = float(random.uniform(0.05, 0.4))
    trial.time_s = trial.time_s + off / session.fps * random.uniform(-1.0, 1.0, len(trial.time_s))
    trial.time_s = trial.time_s - min(trial.time_s[0], 0.0)
    return f"time stamps off by up to {100 * off:.0f} % of a frame"


def frames_dropped(session: Recordings, trial: Recording, random: np.random.Generator) -> str:  # noqa: ARG001
    """Drop frames; the time stamps of the others are right."""
    share = float(random.uniform(0.02, 0.25))
    trial.keep(random.random(len(trial.time_s)) >= share)
    return f"{100 * share:.0f} % of the frames dropped"


def frames_doubled(session: Recordings, trial: Recording, random: np.random.Generator) -> str:  # noqa: ARG001
    """Repeat some pictures in place of the next."""
    twice = 1 + np.flatnonzero(random.random(len(trial.time_s) - 1) < float(random.uniform(0.02, 0.2)))
    trial.xy[twice] = trial.xy[twice - 1]
    return f"{len(twice)} pictures twice"


def stamps_repeated(session: Recordings, trial: Recording, random: np.random.Generator) -> str:
    """Give some frames the time stamp of the frame before."""
    twice = 1 + np.flatnonzero(random.random(len(trial.time_s) - 1) < 0.05)
    trial.time_s = trial.time_s.copy()
    trial.time_s[twice] = trial.time_s[twice - 1]
    session.refusable = True
    return f"{len(twice)} time stamps repeated"


def other_origin(session: Recordings, trial: Recording, random: np.random.Generator) -> str:  # noqa: ARG001
    """Start time anywhere."""
    start = float(random.choice([-3.0, 1000.0, 1.7e9]))
    trial.time_s = trial.time_s + start
    return f"time starts at {start:g} s"


def milliseconds(session: Recordings, trial: Recording, random: np.random.Generator) -> str:  # noqa: ARG001
    """Write time stamps in ms."""
    trial.time_s = 1000.0 * trial.time_s
    session.refused = True
    return "time stamps in ms"


# Wrong in the file, the logs, the choice of trials


def scale_in_other_unit(session: Recordings, trial: Recording, random: np.random.Generator) -> str:  # noqa: ARG001
    """Write the scale length in another unit."""
    session.scale_factor, session.refused = float(random.choice([0.1, 10.0, 100.0, 1000.0])), True
    return f"scale length times {session.scale_factor:g}"


def command_missing(session: Recordings, trial: Recording, random: np.random.Generator) -> str:  # noqa: ARG001
    """Leave out the command."""
    trial.commanded_hz, session.refusable = None, True
    return "no commanded_hz"


def command_wrong(session: Recordings, trial: Recording, random: np.random.Generator) -> str:  # noqa: ARG001
    """Write a command that is off by 10 %."""
    trial.commanded_hz = trial.hz * float(random.choice([0.9, 1.1]))
    return f"commanded_hz {trial.commanded_hz:.3f}, beat {trial.hz:.3f} Hz"


def log_misread(session: Recordings, trial: Recording, random: np.random.Generator) -> str:  # noqa: ARG001
    """Put single readings of the motor a turn off."""
    assert trial.log is not None
    log, commands = trial.log
    rows = random.choice(len(log.time_s), int(random.integers(1, 9)), replace=False)
    off = log.position_rad.copy()
    off[rows] += 2 * np.pi * random.choice([-1.0, 1.0], len(rows))
    trial.log = replace(log, position_rad=off), commands
    return f"{len(rows)} readings a turn off"


def log_modulo(session: Recordings, trial: Recording, random: np.random.Generator) -> str:  # noqa: ARG001
    """Count the motor within one turn."""
    assert trial.log is not None
    log, commands = trial.log
    trial.log = replace(log, position_rad=log.position_rad % (2 * np.pi)), commands
    session.refusable = True
    return "readings modulo one turn"


def unusable_beside(session: Recordings, trial: Recording, random: np.random.Generator) -> str:
    """Add one trial that holds nothing of use."""
    what, name = str(random.choice(["empty", "five frames", "noise"])), "swim_bad"
    frames = 5 if what == "five frames" else len(trial.time_s)
    bad = replace(trial, name=name, role=str(random.choice(["fit", "holdout"])), log=None, touched=True)
    bad.time_s, bad.sure = trial.time_s[:frames].copy(), trial.sure[:frames].copy()
    bad.xy = trial.xy[:frames].copy()
    if what != "five frames":
        spread = np.nanmean(trial.xy, axis=(0, 1)) + 300.0 * random.normal(size=bad.xy.shape)
        bad.xy = np.full(bad.xy.shape, np.nan) if what == "empty" else spread
    bad.said, bad.steady, bad.like_twin, session.refusable = "nothing of it is of use", False, False, True
    session.trials.append(bad)
    return f"{name} beside it, {bad.role}: {what}"


def nothing_to_fit(session: Recordings, trial: Recording, random: np.random.Generator) -> str:  # noqa: ARG001
    """Hold out all trials."""
    session.refused = True
    for each in session.swims:
        each.role = "holdout"
    return "all trials held out"


def _pause(trial: Recording, at_s: float, seconds: float) -> None:
    """Stop the robot from a time on, so long."""
    step = trial.pool_s[1] - trial.pool_s[0]
    place, frames = round(at_s / step), round(seconds / step)
    still = np.repeat(trial.pool_px[place : place + 1], frames, axis=0)
    trial.pool_px = np.concatenate([trial.pool_px[:place], still, trial.pool_px[place:]])
    trial.pool_s = np.arange(len(trial.pool_px)) * step
    trial.like_twin, trial.steady = False, False


def _draw_stretch(trial: Recording, least: float, most: float, random: np.random.Generator) -> tuple[float, float]:
    """Draw from when to when, s: a share of the trial somewhere in it."""
    length, end = float(random.uniform(least, most)), float(trial.time_s[-1])
    start = float(random.uniform(0.0, 1.0 - length))
    return start * end, (start + length) * end


def _hide(session: Recordings, trial: Recording, markers: "range | list[int]", start: float, end: float) -> str:
    since = trial.time_s - trial.time_s[0]
    trial.empty(markers, (since >= start) & (since < end))
    whose = "all" if len(markers) == len(session.markers) else " ".join(session.markers[i] for i in markers)
    return f"{whose} unseen from {start:.1f} to {min(end, since[-1]):.1f} s"


def _exchange(trial: Recording, one: int, two: int, frames: np.ndarray) -> None:
    rows = np.flatnonzero(frames)
    trial.xy[np.ix_(rows, np.array([one, two]))] = trial.xy[np.ix_(rows, np.array([two, one]))]


def _allow_refusal(session: Recordings, trial: Recording) -> None:
    """Let a session be refused whose only fit trial is lost."""
    fitted = [each for each in session.swims if each.role == "fit"]
    session.refusable = session.refusable or fitted == [trial]


KINDS = (
    *(
        Disturbance(change, in_pool=True, of=lambda _session, trial: trial.kind == "swim" and trial.log is None)
        for change in (rests_first, rests, stops, current, turns, scale_drifts, beats_fast, frames_uneven)
    ),
    *map(
        Disturbance,
        (
            *(tail_gap, tail_never_compared, tail_in_few_frames, tail_on_one_side),
            *(head_gap, head_in_first_beats, all_gap, leaves),
            *(confidence_low, confidence_empty, tail_misplaced, head_exchanged, frozen),
            *(stamps_jitter, frames_dropped, frames_doubled, stamps_repeated, other_origin, milliseconds),
            *(scale_in_other_unit, command_missing, command_wrong, unusable_beside, nothing_to_fit),
        ),
    ),
    *(Disturbance(change, of=lambda _session, trial: trial.log is not None) for change in (log_misread, log_modulo)),
    Disturbance(blank_once_held_out, of=lambda _session, trial: trial.kind == "swim" and trial.role == "holdout"),
    Disturbance(tail_swapped, of=lambda session, trial: trial.kind == "swim" and len(session.tail) > 1),
)
