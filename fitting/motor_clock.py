"""Record of the motor in a trial: its log on the clock of the video, its steady drive, and the doubts about both.

`find_clock` lays the log on the video by the codes that both have seen (`fitting.motor_code`). `steady_stretch` finds
the steady drive by the log alone, where the commands do not tell it. `read_motor` does all this for a trial, and the
`MotorRecord` says whether the measured turn of the crank may drive the twin.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import xarray as xr
from threadpoolctl import threadpool_limits

from fitting.frequency import SwimFrequency
from fitting.motor_code import CodeDelay, LateralMotion, code_delay, search, tail_motion
from swimcal.errors import NotEnoughData
from swimcal.flags import Flag
from swimcal.motor_log import MotorCommands, MotorLog, load_commands, load_motor
from swimcal.robot import RobotSpec
from swimcal.runs import CrankTurn
from swimcal.session import TrialSpec
from swimcal.session_file import CameraSpec

FoundBy = Literal["code", "start code", "end code", "given"]

# The clock
CODES = {"start_code": "start code", "end_code": "end code"}  # parts of the commands, in words
LEAST_EXPLAINED = 0.3  # least share of the tail's motion over a code that the crank's explains
OUTSIDE_S = 0.1  # time of a code that a log may leave out: the last reading precedes the last command's end
CLEARLY = 1.2  # least ratio of the gain to that at any other offset
# Largest plausible difference of the rate from 1: quartz agrees ten times better, 59.94 Hz taken for 60 reaches it.
PLAUSIBLE_RATE = 1e-3
QUARTZ = 1e-4  # relative standard error of two clocks against each other, before any code is seen
LAG_SPREAD_S = {"dry": 0.0003, "swim": 0.0035}  # standard deviation of the tail's lag over the crank's angle
CONTRADICTS = 3.0  # standard errors beyond which the codes overrule the tolerance of quartz

# Flags of a log
OFF_COMMAND = 0.05  # relative difference beyond which the motor did not follow its command
HOLE_S = 0.1  # time without a reading in which the crank may do anything
SAG = 0.1  # relative fall of the supply voltage that is worth a flag

ERRORS = {0: "input voltage", 2: "overheating", 3: "encoder", 4: "electrical shock", 5: "overload"}
"""Bits of the hardware error status (ROBOTIS e-Manual, XW540-T140-R)."""

# The steady drive
STEADY = 0.05  # largest relative difference of the mean over a turn from that of the drive
_STEP_S = 0.02  # step of the search for the steady drive
_FASTEST = 98  # percentile of the speed that counts as the highest

# The record
RISE_S = 1.0  # time after the drive's command in which the motor comes up to speed; as in `calib capture`
COVERED = 0.5  # share of the frames that a log on a given clock must cover to be believed to belong to them
# Relative difference, besides three standard errors, of tail and crank if the log is another trial's: all trials have
# the same codes.
BEAT_OFF_CRANK = 0.01
OTHER_COMMAND_KIND = "other_command"
OFF_CRANK_KIND = "beat_off_crank"
OTHER_COMMAND = 0.02  # relative difference of another command; a servo's speeds have steps of 0.004 turns a second
FEWEST_FRAMES = 12  # least number of frames of a drive
_FEWEST_READINGS = 5  # least number of readings of the shaft in a log


# The clock.


@dataclass(frozen=True)
class MotorClock:
    """The clock of a motor log: motor time = rate * video time + offset.

    The moment of a code is that at which the tail follows the crank. It lags behind by about 1 ms in air and 9 ms in
    water (the built-in robot): the offset is off by as much, and in a fit the crank's phase takes it up. In water it is
    3 to 12 ms, with the crank's angle; that it differs between the codes is in the standard errors (`LAG_SPREAD_S`),
    besides the tracking and, for the rate, the tolerance of quartz. For tracks like the published ones the standard
    error of the rate is 1e-4. Where the crank is sideways at a code the tail hardly moves: such a code is worth less,
    and its error may then reach some 50 ms.

    Attributes:
        offset_s: motor clock minus video clock at the video's time 0, s.
        offset_se_s: its standard error; nan where it was given.
        rate: seconds of the motor's clock in one of the video's.
        rate_se: its standard error; nan where it was given.
        found_by: "code": both codes; "start code" or "end code": one alone, the rate taken for 1; "given": neither, the
            offset is that of `session.toml`.
    """

    offset_s: float
    offset_se_s: float
    rate: float
    rate_se: float
    found_by: FoundBy
    flags: tuple[Flag, ...] = ()

    def video_s(self, motor_s: float) -> float:
        """Convert a time of the motor's clock to the video's."""
        return (motor_s - self.offset_s) / self.rate


@threadpool_limits.wrap(limits=1, user_api="blas")  # the matrices are small: threads cost more than they save
def find_clock(
    tail: LateralMotion | None, turn: CrankTurn, commands: MotorCommands | None, zero_s: float, spec: TrialSpec
) -> MotorClock:
    """Find the clock of a log from the codes of a trial in its video.

    Args:
        tail: n frames; None where no tail is seen.
        turn: turn of the crank, on the motor's clock less `zero_s`.
        commands: commands on the motor's clock; None where they are not known.
        zero_s: subtracted so that the numbers stay small: a host's clock may count days.
        spec: the trial, for its offset and whether it swims.
    """
    commanded = {part: span for part in CODES if commands and (span := commands.span_s(part)) is not None}
    codes = {part: (begins - zero_s, ends - zero_s) for part, (begins, ends) in commanded.items()}
    # Beyond the ends of the log the crank's angle is a guess.
    first_s, last_s = turn.start_s - OUTSIDE_S, turn.end_s + OUTSIDE_S
    codes = {part: span for part, span in codes.items() if span[0] > first_s and span[1] < last_s}
    spans = list(codes.values())
    seen: dict[str, CodeDelay] = {}
    found = search(tail, turn, spans) if tail is not None and spans else None
    if tail is not None and found is not None and found.gain > CLEARLY * found.next_gain:
        delays = [code_delay(tail, turn, span, found.offset_s) for span in spans]
        seen = {p: d for p, d in zip(codes, delays, strict=True) if d is not None and d.explained >= LEAST_EXPLAINED}
        lag_s = LAG_SPREAD_S[spec.kind]
        seen = {part: delay._replace(se_s=float(np.hypot(delay.se_s, lag_s))) for part, delay in seen.items()}
    flags = tuple(_unseen_flag(part, part in codes) for part in commanded if part not in seen)
    if not seen:
        given_s = spec.motor_offset_s
        message = f"offset {given_s:g} s as in session.toml, not found from a code; the rate is taken for 1"
        return MotorClock(given_s, np.nan, 1.0, np.nan, "given", (*flags, Flag("clock_given", message=message)))
    offset_s, offset_se_s, rate, rate_se = _combine(list(seen.values()))
    by = "code" if len(seen) > 1 else CODES[next(iter(seen))]
    return MotorClock(offset_s + zero_s, offset_se_s, rate, rate_se, by, (*flags, *_flag_implausible(rate, rate_se)))  # type: ignore[arg-type]


def _combine(codes: list[CodeDelay]) -> tuple[float, float, float, float]:
    """Return the offset at the video's time 0 and the rate, each with its standard error.

    Codes far apart give the rate better than the tolerance of quartz, codes close together worse: both count, unless
    they contradict each other.
    """
    if len(codes) > 1:
        alone = _regress(codes, np.inf)
        if abs(alone[2] - 1) > CONTRADICTS * float(np.hypot(alone[3], QUARTZ)):
            return alone
    return _regress(codes, QUARTZ)


def _regress(codes: list[CodeDelay], drift_se: float) -> tuple[float, float, float, float]:
    """Return offset and rate if the rates of the clocks are known beforehand to agree with this standard error."""
    columns = np.array([[1.0, code.middle_s] for code in codes] + [[0.0, 1.0]])  # offset, drift
    found = np.array([code.offset_s for code in codes] + [0.0])
    weight = 1 / np.array([code.se_s for code in codes] + [drift_se])
    covariance = np.linalg.inv((columns * weight[:, None] ** 2).T @ columns)
    offset_s, drift = covariance @ (columns.T @ (weight**2 * found))
    offset_se_s, rate_se = np.sqrt(np.diag(covariance))
    return float(offset_s), float(offset_se_s), float(1 + drift), float(rate_se)


def _unseen_flag(part: str, logged: bool) -> Flag:
    why = (
        "the tail's motion does not show it clearly in one place: is the whole of it in the video?"
        if logged
        else "the log does not hold the whole of it"
    )
    return Flag("code_not_seen", message=f"the {CODES[part]} was commanded, but {why}")


def _flag_implausible(rate: float, rate_se: float) -> tuple[Flag, ...]:
    if abs(rate - 1) <= PLAUSIBLE_RATE + 2 * rate_se:
        return ()
    message = (
        f"the motor's clock runs {100 * (rate - 1):+.2f} % faster than the video's; quartz clocks agree to "
        "0.01 %: are the video's time stamps right, or [camera] fps?"
    )
    return (Flag("clock_rate", message=message),)


# The log.


def log_flags(log: MotorLog, drive_s: tuple[float, float], measured_hz: float, commanded_hz: float) -> Iterator[Flag]:
    """Return the doubts about a log with its steady drive.

    Args:
        log: the log.
        drive_s: first and last instant of the steady drive, on the motor's clock.
        measured_hz: turns a second over it; nan where not known.
        commanded_hz: commanded turns a second; nan where not known.
    """
    yield from log.flags
    if bits := int(np.bitwise_or.reduce(np.nan_to_num(log.error).astype(int))):
        named = [ERRORS.get(bit, f"bit {bit}") for bit in range(bits.bit_length()) if bits >> bit & 1]
        yield Flag("motor_error", message=f"the motor reported: {', '.join(named)}")
    if commanded_hz > 0 and abs(measured_hz / commanded_hz - 1) > OFF_COMMAND:
        off = 100 * (measured_hz / commanded_hz - 1)
        message = f"the motor made {measured_hz:.3f} turns a second, {off:+.0f} % off the commanded {commanded_hz:.3g}"
        yield Flag("motor_slow", message=message)
    times = log.time_s[np.isfinite(log.position_rad)]
    times = times[(times >= drive_s[0]) & (times <= drive_s[1])]
    if (longest := float(np.diff(times).max(initial=0.0))) > HOLE_S:
        message = f"up to {longest:.2f} s of the drive without a reading; the crank is taken to turn smoothly there"
        yield Flag("log_gap", message=message)
    voltage = log.voltage_v[np.isfinite(log.voltage_v)]
    if len(voltage) and voltage.min() < (1 - SAG) * voltage.max():
        message = (
            f"the supply falls from {voltage.max():.1f} to {voltage.min():.1f} V; the motor slows down with it: "
            "is the supply strong enough?"
        )
        yield Flag("supply_sags", message=message)


def steady_stretch(turn: CrankTurn) -> tuple[float, float]:
    """Return the first and last instant of the steady drive, on the clock of `turn`; the whole log where there is none.

    The speed is taken over whole turns of the crank, so that one that swings within each turn is steady too, and a
    code, which goes to and fro, is not.
    """
    time_s = np.arange(turn.start_s, turn.end_s, _STEP_S)
    period_s = 2 * np.pi / max(float(np.percentile(turn.speed(time_s), _FASTEST)), 1e-9)
    middle_s = time_s[(time_s >= turn.start_s + period_s / 2) & (time_s <= turn.end_s - period_s / 2)]
    if not len(middle_s):
        return turn.start_s, turn.end_s
    speed = (turn.angle(middle_s + period_s / 2) - turn.angle(middle_s - period_s / 2)) / period_s  # (k,)
    drive = np.median(speed[speed > speed.max() / 2]) if speed.max() > 0 else 0.0
    steady = np.abs(speed - drive) <= STEADY * drive
    begins, ends = np.flatnonzero(np.diff(np.pad(steady, 1).astype(int))).reshape(-1, 2).T
    if not len(begins):
        return turn.start_s, turn.end_s
    longest = int(np.argmax(ends - begins))
    return float(middle_s[begins[longest]] - period_s / 2), float(middle_s[ends[longest] - 1] + period_s / 2)


# The record of a trial.


@dataclass(frozen=True, eq=False)
class MotorRecord:
    """Record of the motor in a trial of n frames.

    Attributes:
        log: the log as read, on the motor's clock.
        commands: the commands as sent to it, on the same clock; None where they are not known.
        clock: clock of the log, against the video's.
        turn: turn of the crank, on the clock of the video (time as in the tracks).
        drive_s: the steady stretch on the clock of the video, from `RISE_S` after its command to its end; without
            commands, the longest one by the log itself. As far as it was logged, and filmed where the clock is known.
        measured_hz: mean turns a second over it.
        commanded_hz: commanded turns a second; nan where not known.
        ripple: amplitude of a sine as large as the changes of the speed over it, relative to its mean.
        usable: whether clock and log are believed, so that the turn may drive the twin.
        flags: what is doubtful about it.
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

    @property
    def laid(self) -> bool:
        """Return whether it is known when in the video the motor drove: also of an unusable log whose code was seen."""
        return self.usable or self.clock.found_by != "given"

    @property
    def logged_hz(self) -> float | None:
        """Turns a second over the drive by the motor's own clock; None of a log that may be another trial's.

        That is a log whose commands differ from the session's or, without commands, one whose tail beats otherwise,
        unless the motor turned as fast as this trial asks for.
        """
        kinds, hz = {flag.kind for flag in self.flags}, self.measured_hz / self.clock.rate
        as_asked = self.commands is not None or abs(hz / self.commanded_hz - 1) <= OTHER_COMMAND
        if OTHER_COMMAND_KIND in kinds or (OFF_CRANK_KIND in kinds and not as_asked):
            return None
        return hz

    def against(self, beat: SwimFrequency, time_s: np.ndarray) -> MotorRecord:
        """Check the record against the tail's beat.

        If the beat differs from the crank's, the log is another trial's, and is not usable.

        Args:
            beat: the tail's beat.
            time_s: (n,) times of its frames.
        """
        if not self.usable:
            return self
        hz = self.turn.mean_hz(float(time_s[0]), float(time_s[-1]))
        if abs(beat.hz - hz) <= np.fmax(BEAT_OFF_CRANK * hz, 3 * beat.se_hz):
            return self
        message = (
            f"the tail beats at {beat.hz:.3f} Hz, but by its motor log the crank makes {hz:.3f} turns a second "
            f"({100 * (hz / beat.hz - 1):+.1f} %): the log is not used. Is it this trial's, is the frame rate right?"
        )
        return replace(self, usable=False, flags=(*self.flags, Flag(OFF_CRANK_KIND, message=message)))

    def driven(self, tracks: xr.Dataset, name: str) -> tuple[int, xr.Dataset]:
        """Return the number of the first frame of the drive, and its frames; all frames where its time is not known.

        Args:
            tracks: n frames.
            name: name of the trial, for messages.

        Raises:
            NotEnoughData: the drive of the trial was hardly filmed.
        """
        if not self.laid:
            return 0, tracks
        inside = np.flatnonzero((tracks.time.values >= self.drive_s[0]) & (tracks.time.values <= self.drive_s[1]))
        if len(inside) < FEWEST_FRAMES:
            raise NotEnoughData(
                f"trial {name}: {len(inside)} frames show the steady drive of the motor; at least {FEWEST_FRAMES} are "
                "needed: record longer, or leave its motor log out of session.toml"
            )
        kept = slice(int(inside[0]), int(inside[-1]) + 1)
        return kept.start, tracks.isel(time=kept)


def read_motor(spec: TrialSpec, tracks: xr.Dataset, camera: CameraSpec, robot: RobotSpec) -> MotorRecord | None:
    """Read the motor log of a trial and find its clock; None where the trial has none.

    Args:
        spec: the trial.
        tracks: its n frames.
        camera: the camera that filmed them.
        robot: the robot.

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
    return motor_record(spec, log, commands, tail, tracks.time.values)


def motor_record(
    spec: TrialSpec, log: MotorLog, commands: MotorCommands | None, tail: LateralMotion | None, time_s: np.ndarray
) -> MotorRecord:
    """Build the record of the motor from what `read_motor` read.

    Args:
        spec: the trial.
        log: its motor log.
        commands: its commands, where they are known.
        tail: motion of its tail, where it is seen.
        time_s: (n,) times of the frames.

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
    clock = find_clock(tail, turn, commands, zero_s, spec)
    turn = turn.shifted(clock.offset_s - zero_s, clock.rate)
    covered = float(((time_s >= turn.start_s) & (time_s <= turn.end_s)).mean())
    usable = clock.found_by != "given" or covered >= COVERED
    span_s = commands.span_s("drive") if commands else None
    # The steady drive as commanded, else as logged; on the clock of the video.
    wanted_s = (clock.video_s(span_s[0] + RISE_S), clock.video_s(span_s[1])) if span_s else steady_stretch(turn)
    drive_s = _clip(wanted_s, turn, time_s) if usable else _clip(wanted_s, turn)
    measured_hz, speed = turn.mean_hz(*drive_s), turn.speed(np.arange(*drive_s, 0.005))
    commanded_hz = np.nan if spec.commanded_hz is None else spec.commanded_hz
    if commands is not None and "drive" in commands.part:
        commanded_hz = abs(float(commands.velocity_rad_s[commands.part.index("drive")])) / (2 * np.pi)
    on_motor = clock.offset_s + clock.rate * drive_s[0], clock.offset_s + clock.rate * drive_s[1]
    of_clock = (*clock.flags, *_flag_short(wanted_s, turn)) if usable else _flag_not_laid(clock, covered)
    return MotorRecord(
        log=log,
        commands=commands,
        clock=clock,
        turn=turn,
        drive_s=drive_s,
        measured_hz=measured_hz,
        commanded_hz=commanded_hz,
        ripple=float(np.sqrt(2) * speed.std() / max(2 * np.pi * abs(measured_hz), 1e-9)),
        usable=usable,
        flags=(
            *of_clock,
            *_flag_other_command(commanded_hz, spec),
            *log_flags(log, on_motor, measured_hz, commanded_hz),
        ),
    )


def _clip(wanted_s: tuple[float, float], turn: CrankTurn, time_s: np.ndarray | None = None) -> tuple[float, float]:
    """Clip a stretch to what was logged and, if frames (n,) are given, filmed; all of it where nothing is left."""
    first_s, last_s = (-np.inf, np.inf) if time_s is None else (float(time_s[0]), float(time_s[-1]))
    within_s = max(wanted_s[0], turn.start_s, first_s), min(wanted_s[1], turn.end_s, last_s)
    return within_s if within_s[1] > within_s[0] else wanted_s


def _flag_other_command(commanded_hz: float, spec: TrialSpec) -> tuple[Flag, ...]:
    if spec.commanded_hz is None or not abs(commanded_hz / spec.commanded_hz - 1) > OTHER_COMMAND:
        return ()
    message = (
        f"the commands of its motor log ask for {commanded_hz:.3g} turns a second, commanded_hz in session.toml is "
        f"{spec.commanded_hz:g}: are log and commands this trial's?"
    )
    return (Flag(OTHER_COMMAND_KIND, message=message),)


def _flag_not_laid(clock: MotorClock, covered: float) -> tuple[Flag, ...]:
    """Explain why a log is not used whose clock was only given, and what to give."""
    message = (
        f"the motor log could not be laid on the video and is not used: no code was seen, and motor_offset_s = "
        f"{clock.offset_s:g} makes it cover {100 * covered:.0f} % of the frames. Film the coded wiggles, or give "
        "motor_offset_s, the motor's clock minus the video's"
    )
    return (*(flag for flag in clock.flags if flag.kind != "clock_given"), Flag("clock_given", message=message))


def _flag_short(wanted_s: tuple[float, float], turn: CrankTurn) -> tuple[Flag, ...]:
    missing = max(turn.start_s - wanted_s[0], 0.0) + max(wanted_s[1] - turn.end_s, 0.0)
    if missing <= 0.1:
        return ()
    message = f"the motor log leaves out {missing:.1f} s of the {wanted_s[1] - wanted_s[0]:.1f} s that should be there"
    return (Flag("short_log", message=message),)
