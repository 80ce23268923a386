"""What the motor did in a trial, on the clock of the video."""

from dataclasses import dataclass

import numpy as np

from fitting.motor_clock.clock import MotorClock, find_clock
from fitting.motor_clock.log_flags import log_flags
from fitting.motor_clock.tail_motion import TailMotion, tail_motion
from session import (
    CameraSpec,
    Flag,
    MotorCommands,
    MotorLog,
    NotEnoughData,
    Tracks,
    TrialSpec,
    load_commands,
    load_motor,
)
from swimmer import CrankTurn, RobotSpec

RISE_S = 1.0  # after the command of the drive, in which the motor comes up to speed; as in `calib capture`
COVERED = 0.5  # share of the frames that a log on a given clock must cover to be believed to belong to them
FEWEST_FRAMES = 12
_FEWEST_READINGS = 5


@dataclass(frozen=True, eq=False)
class MotorRecord:
    """What the motor did in a trial of n frames.

    Attributes:
        log: as read, on the motor's clock.
        commands: what it was told, on the same clock; None where that is not known.
        clock: of the log, against the video's.
        turn: of the crank, on the clock of the video (time as in the tracks).
        drive_s: the steady stretch on the clock of the video, from `RISE_S` after its command to its end, as far as
            it was filmed; without commands, what of the log was filmed.
        measured_hz: mean turns a second over it.
        commanded_hz: nan where not known.
        ripple: amplitude of a sine as large as the changes of the speed over it, relative to its mean.
        usable: whether the clock is believed, so that the turn may drive the twin.
        flags: of log and clock.
    """

    log: MotorLog
    commands: MotorCommands | None
    clock: MotorClock
    turn: CrankTurn
    drive_s: tuple[float, float]
    measured_hz: float
    commanded_hz: float
    ripple: float
    usable: bool
    flags: tuple[Flag, ...]

    def driven(self, tracks: Tracks, name: str) -> tuple[int, Tracks]:
        """The frames of the drive, and the number of the first; all frames where the clock is not believed.

        Raises:
            NotEnoughData: the drive of the trial of this name was hardly filmed.
        """
        if not self.usable:
            return 0, tracks
        inside = np.flatnonzero((tracks.time_s >= self.drive_s[0]) & (tracks.time_s <= self.drive_s[1]))
        if len(inside) < FEWEST_FRAMES:
            raise NotEnoughData(
                f"trial {name}: {len(inside)} frames show the steady drive of the motor; at least {FEWEST_FRAMES} are "
                "needed: record longer, or leave its motor log out of session.toml"
            )
        kept = slice(int(inside[0]), int(inside[-1]) + 1)
        part = Tracks(tracks.markers, tracks.time_s[kept], tracks.position_px[kept], tracks.confidence[kept])
        return kept.start, part


def read_motor(spec: TrialSpec, tracks: Tracks, camera: CameraSpec, robot: RobotSpec) -> MotorRecord | None:
    """Reads the motor log of a trial and finds its clock; None where the trial has none.

    Args:
        spec: the trial.
        tracks: all n frames of it, codes included.
        camera, robot: what filmed it and what was filmed.

    Raises:
        InputError: log or commands cannot be read.
        NotEnoughData: fewer than five readings of the shaft.
    """
    if spec.motor is None:
        return None
    log = load_motor(spec.motor)
    commands = None if spec.commands is None else load_commands(spec.commands)
    try:
        tail = tail_motion(tracks, camera, robot)
    except NotEnoughData:
        tail = None  # the measurement itself will say so
    return motor_record(spec, log, commands, tail, tracks.time_s)


def motor_record(
    spec: TrialSpec, log: MotorLog, commands: MotorCommands | None, tail: TailMotion | None, time_s: np.ndarray
) -> MotorRecord:
    """What `read_motor` makes of what it read.

    Args:
        spec: the trial, for its name, offset and command.
        log, commands: of the motor.
        tail: in which the codes are looked for.
        time_s: (n,) of the frames.

    Raises:
        NotEnoughData: fewer than five readings of the shaft.
    """
    read = np.isfinite(log.position_rad)
    if read.sum() < _FEWEST_READINGS:
        raise NotEnoughData(
            f"trial {spec.name}: its motor log holds {int(read.sum())} readings of the shaft; at least "
            f"{_FEWEST_READINGS} are needed: leave it out of session.toml"
        )
    zero_s = float(log.time_s[0])
    turn = CrankTurn.measured(log.time_s[read] - zero_s, log.position_rad[read])
    clock = find_clock(tail, turn, commands, zero_s, spec.motor_offset_s)
    turn = turn.shifted(clock.offset_s - zero_s, clock.rate)
    wanted_s = _wanted(clock, commands, time_s)
    drive_s = max(wanted_s[0], float(time_s[0]), turn.start_s), min(wanted_s[1], float(time_s[-1]), turn.end_s)
    driven_s = drive_s if drive_s[1] > drive_s[0] else wanted_s  # of a log that has nothing to do with the video
    measured_hz, ripple = _speed(turn, driven_s)
    commanded_hz = _commanded(commands, spec)
    on_motor = clock.offset_s + clock.rate * driven_s[0], clock.offset_s + clock.rate * driven_s[1]
    covered = float(((time_s >= turn.start_s) & (time_s <= turn.end_s)).mean())
    return MotorRecord(
        log=log,
        commands=commands,
        clock=clock,
        turn=turn,
        drive_s=driven_s,
        measured_hz=measured_hz,
        commanded_hz=commanded_hz,
        ripple=ripple,
        usable=clock.found_by != "given" or covered >= COVERED,
        flags=(*clock.flags, *_short(wanted_s, turn), *log_flags(log, on_motor, measured_hz, commanded_hz)),
    )


def _wanted(clock: MotorClock, commands: MotorCommands | None, time_s: np.ndarray) -> tuple[float, float]:
    """The steady drive as commanded, else the whole video; on the clock of the video."""
    told = commands.span_s("drive") if commands else None
    if told is None:
        return float(time_s[0]), float(time_s[-1])
    return clock.video_s(told[0] + RISE_S), clock.video_s(told[1])


def _speed(turn: CrankTurn, stretch_s: tuple[float, float]) -> tuple[float, float]:
    """Mean turns a second, and ripple."""
    speed = turn.speed(np.arange(*stretch_s, 0.005))
    mean_hz = turn.mean_hz(*stretch_s)
    return mean_hz, float(np.sqrt(2) * speed.std() / max(2 * np.pi * abs(mean_hz), 1e-9))


def _commanded(commands: MotorCommands | None, spec: TrialSpec) -> float:
    """Turns a second of the drive; those of the session where the commands do not tell; nan where neither does."""
    if commands is not None and "drive" in commands.part:
        return abs(float(commands.velocity_rad_s[commands.part.index("drive")])) / (2 * np.pi)
    return spec.commanded_hz if spec.commanded_hz is not None else np.nan


def _short(wanted_s: tuple[float, float], turn: CrankTurn) -> tuple[Flag, ...]:
    missing = max(turn.start_s - wanted_s[0], 0.0) + max(wanted_s[1] - turn.end_s, 0.0)
    if missing <= 0.1:
        return ()
    message = f"the motor log leaves out {missing:.1f} s of the {wanted_s[1] - wanted_s[0]:.1f} s that should be there"
    return (Flag("short_log", message=message),)
