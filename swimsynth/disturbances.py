"""The disturbances of a synthetic recording: tracking noise, the motor's errors, and the random streams of both.

A `Stream` belongs to one trial and to what draws in it, so that changing one trial leaves the others as they are.

`TrackingNoise` is what a tracker adds to the place of a marker: lasting errors, boxes placed by hand, a half-pixel
grid.

`drive` takes the motor of a trial from the speeds it is commanded, late and ramped, to the turn of its shaft. All times
of the motor are on its own clock, that of the computer which drives and logs it.
"""

from dataclasses import dataclass
from enum import Enum
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import make_interp_spline
from scipy.signal import lfilter

from swimcal.motor_log import MotorCommands
from swimcal.robot import NonNegative, Positive
from swimcal.runs import CrankTurn
from swimcal.toml import TomlTable

START_CODE = (1, 1, 1, -1, 1, -1, 1, -1, -1, 1, -1, -1, 1, 1, -1, -1)
CHIP_S = 0.25
CHIP_TURNS_PER_S = 0.25
REST_S = 0.5
RUN_OUT_S = 1.0

COMMAND_DELAY_S = 0.0015  # mean time from when a speed is due until the motor has it
RISE_S = 1.0  # time after the drive's command before its speed counts as steady; as in `calib capture`
_GRID_S = 0.002

Share = Annotated[float, Field(ge=0, lt=0.3)]


class Stream(Enum):
    """The kinds of random streams; the value is the last entry of their seeds, where it is not 0."""

    SWIM_TRACKER = 0
    DRY_TRACKER = 1
    DECAY_TRACKER = 2
    SWIM_MOTOR = 3
    DRY_MOTOR = 4

    def of(self, seed: int, number: int) -> np.random.Generator:
        """Return the generator of one trial, by its number among those of its kind, from 0."""
        return np.random.default_rng([seed, number, *([self.value] if self.value else [])])


class TrackingNoise(TomlTable):
    """Errors of tracked boxes, the same in x and y, and what neighbours along the body have of them in common.

    The defaults are those we measured on the published tracks: boxes of whole pixels, hence centres on a half-pixel
    grid, and residuals that stay correlated over 3 to 17 frames at 60 frames a second.

    Attributes:
        sd_px: standard deviation of the error that changes with time, before rounding to the grid.
        correlation_s: time in which its correlation falls to 1/e; 0 for white noise.
        shared: share of the variance of these errors that is common to markers in one place; the rest is each marker's
            own. The placement of boxes and the rounding are never shared.
        shared_length_m: distance along the body over which the correlation of the common share falls to 1/e.
        placement_sd_px: standard deviation of the offset between a box and its marker, constant over a trial.
        half_pixel_grid: whether positions are rounded to halves of a pixel.
    """

    sd_px: NonNegative = 0.5
    correlation_s: NonNegative = 0.1
    placement_sd_px: NonNegative = 2.0
    half_pixel_grid: bool = True
    shared: Annotated[float, Field(ge=0, le=1)] = 0.0
    shared_length_m: Positive = 0.2

    def across(self, place_m: np.ndarray) -> np.ndarray:
        """Compute the (m, m) correlation between the lasting errors of markers at places (m,) along the body, m."""
        apart_m = np.abs(place_m[:, None] - place_m)
        return (1.0 - self.shared) * np.eye(len(place_m)) + self.shared * np.exp(-apart_m / self.shared_length_m)


NOISELESS = TrackingNoise(sd_px=0.0, correlation_s=0.0, placement_sd_px=0.0, half_pixel_grid=False)


def lasting_errors(
    shape: tuple[int, ...],
    step_s: float,
    noise: TrackingNoise,
    random: np.random.Generator,
    place_m: np.ndarray | None = None,
) -> np.ndarray:
    """Draw stationary errors with exponentially falling autocorrelation, px.

    The exact discretisation of the Ornstein-Uhlenbeck process: AR(1) with coefficient exp(-step / correlation), begun
    in the stationary distribution (Gillespie 1996, Exact numerical simulation of the Ornstein-Uhlenbeck process and its
    integral, Phys. Rev. E 54, 2084).

    Args:
        shape: (n, ...) for n frames of series; (n, m, ...) for markers that have errors in common.
        step_s: time between frames.
        noise: its `sd_px`, `correlation_s` and, with places, `shared` are used.
        random: draws the errors.
        place_m: (m,) places of the markers along the body; without them all series are independent.
    """
    carried = np.exp(-step_s / noise.correlation_s) if noise.correlation_s > 0 else 0.0
    fresh = noise.sd_px * random.standard_normal(shape)
    if place_m is not None and noise.shared > 0:
        fresh = np.einsum("ab,nb...->na...", np.linalg.cholesky(noise.across(place_m)), fresh)
    fresh[1:] *= np.sqrt(1.0 - carried**2)
    return lfilter([1.0], [1.0, -carried], fresh, axis=0)


def placement_offsets(markers: int, noise: TrackingNoise, random: np.random.Generator) -> np.ndarray:
    """Draw the (m, 2) offsets of the boxes of a trial from their markers, px."""
    return noise.placement_sd_px * random.standard_normal((markers, 2))


def on_grid(position_px: np.ndarray, noise: TrackingNoise) -> np.ndarray:
    """Round positions of any shape to the grid of the tracker, px; unchanged where it has none."""
    return np.round(2.0 * position_px) / 2.0 if noise.half_pixel_grid else position_px


# The motor.


class Step(NamedTuple):
    """A speed that is held for a time; `part` is "rest", "start_code", "drive" or "end_code"."""

    part: str
    turns_per_s: float
    seconds: float


def schedule(hz: float, seconds: float) -> tuple[Step, ...]:
    """List the steps of a trial: rest, start code, rest, drive, run-out, end code (the start code backwards), rest.

    Args:
        hz: speed of the drive, turns a second.
        seconds: duration of the drive.
    """
    rest = Step("rest", 0.0, REST_S)
    start, end = (
        [Step(part, chip * CHIP_TURNS_PER_S, CHIP_S) for chip in chips]
        for part, chips in (("start_code", START_CODE), ("end_code", START_CODE[::-1]))
    )
    return (rest, *start, rest, Step("drive", hz, seconds), Step("rest", 0.0, RUN_OUT_S), *end, rest)


class SyntheticMotor(TomlTable):
    """The settings of the motor that drives a trial, and of the clock of its log.

    Attributes:
        drive_s: how long it is commanded the trial's speed, between start code and end code.
        starts_s: from the first frame until schedule and log begin, on the clock of the video.
        clock_offset_s: motor clock minus video clock in the first frame.
        clock_rate: seconds of the motor's clock in one of the video's.
        acceleration_turns_per_s2: acceleration of its ramps.
        ripple: swing of its speed once and twice a turn, by the load, as shares of the speed.
        reading_s: time between two readings.
        jitter_s: mean delay of a reading.
    """

    drive_s: Positive = 6.0
    starts_s: NonNegative = 0.8
    clock_offset_s: float = 4217.3
    clock_rate: Annotated[float, Field(gt=0.9, lt=1.1)] = 1.00004
    acceleration_turns_per_s2: Positive = 4.0
    ripple: tuple[Share, Share] = (0.02, 0.03)
    reading_s: Positive = 0.01
    jitter_s: NonNegative = 0.0006

    @property
    def steps(self) -> tuple[Step, ...]:
        """The schedule, with a speed of 1 turn/s in the drive."""
        return schedule(1.0, self.drive_s)

    @property
    def ends_s(self) -> float:
        """The time at which the schedule ends, on the clock of the video."""
        return self.starts_s + sum(step.seconds for step in self.steps) / self.clock_rate

    def clock(self, video_s: float) -> float:
        """Convert a time of the video to the motor's clock."""
        return self.clock_offset_s + self.clock_rate * video_s

    def video(self, clock_s: np.ndarray) -> np.ndarray:
        """Convert times of the motor's clock to that of the video."""
        return (clock_s - self.clock_offset_s) / self.clock_rate


@dataclass(frozen=True, eq=False)
class MotorDrive:
    """The commands to the motor in a trial, and how its shaft would turn without the tail's springiness.

    Attributes:
        commands: k speeds, and when the motor got them.
        end_s: the time at which the last command ends.
        time_s: (g,) a fine grid of times.
        reference_rad_s: (g,) the ramped speed that the motor aims at.
        speed_rad_s: (g,) the speed of the shaft.
        turn: the angle of the shaft, at rest outside the schedule.
    """

    commands: MotorCommands
    end_s: float
    time_s: np.ndarray
    reference_rad_s: np.ndarray
    speed_rad_s: np.ndarray
    turn: CrankTurn

    @property
    def steady_s(self) -> tuple[float, float]:
        """Start and end of the stretch of the drive in which the speed is steady."""
        drive = self.commands.part.index("drive")
        return float(self.commands.time_s[drive]) + RISE_S, float(self.commands.time_s[drive + 1])


def drive(
    motor: SyntheticMotor, commanded_hz: float, reached_hz: float, phase_rad: float, random: np.random.Generator
) -> MotorDrive:
    """Drive a trial: compute the commands, which come late, and the turn of the shaft.

    The motor's lag behind a command grows with the square of the speed, so that it reaches the speed given. The load
    lets its speed ripple with the crank's angle: an even turn s becomes s + a sin s + b/2 sin 2 s.

    Args:
        motor: its settings.
        commanded_hz: commanded speed, turns a second.
        reached_hz: mean speed that the motor reaches, turns a second.
        phase_rad: crank angle at the start.
        random: draws the delays of the commands.
    """
    steps = schedule(commanded_hz, motor.drive_s)
    commanded_rad_s = 2 * np.pi * np.array([step.turns_per_s for step in steps])  # (k,)
    ends_s = np.cumsum([step.seconds for step in steps]) + motor.clock(motor.starts_s)
    due_s = np.append(motor.clock(motor.starts_s), ends_s[:-1])
    got_s = due_s + random.exponential(COMMAND_DELAY_S, len(steps))
    lag = (1 - reached_hz / commanded_hz) / (2 * np.pi * commanded_hz)  # share of the speed lost for each rad/s
    reached_rad_s = commanded_rad_s * (1 - lag * np.abs(commanded_rad_s))
    time_s = np.arange(due_s[0], ends_s[-1] + _GRID_S, _GRID_S)  # (g,)
    acceleration = 2 * np.pi * motor.acceleration_turns_per_s2
    even_rad_s = _ramp(time_s, got_s, reached_rad_s, acceleration)
    even_rad = phase_rad + cumulative_trapezoid(even_rad_s, time_s, initial=0.0)
    once, twice = motor.ripple
    angle_rad = even_rad + once * np.sin(even_rad) + twice / 2 * np.sin(2 * even_rad)
    return MotorDrive(
        commands=MotorCommands(got_s, tuple(step.part for step in steps), commanded_rad_s),
        end_s=float(ends_s[-1]),
        time_s=time_s,
        reference_rad_s=_ramp(time_s, got_s, commanded_rad_s, acceleration),
        speed_rad_s=even_rad_s * (1 + once * np.cos(even_rad) + twice * np.cos(2 * even_rad)),
        turn=CrankTurn(make_interp_spline(time_s, angle_rad, k=3), float(time_s[0]), float(time_s[-1])),
    )


def _ramp(time_s: np.ndarray, commanded_s: np.ndarray, goal_rad_s: np.ndarray, acceleration: float) -> np.ndarray:
    """Compute the (g,) speed from rest towards each of k goals from when it is commanded, rad/s; ramps in rad/s^2."""
    speed = np.zeros(len(time_s))
    begins = np.append(commanded_s, time_s[-1])
    now = 0.0
    for goal, start_s, end_s in zip(goal_rad_s, begins[:-1], begins[1:], strict=True):
        here = time_s >= start_s
        reach = acceleration * (time_s[here] - start_s)
        speed[here] = now + np.clip(goal - now, -reach, reach)
        furthest = acceleration * (end_s - start_s)
        now += float(np.clip(goal - now, -furthest, furthest))
    return speed
