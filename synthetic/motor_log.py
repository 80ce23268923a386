"""The motor log of a trial, as `calib capture` writes it: encoder steps, speed steps, uneven times.

Units of the motor: ROBOTIS e-Manual, XW540-T140-R.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from session.commands import COMMAND_COLUMNS, MotorCommands
from session.motor import MOTOR_COLUMNS, MotorLog
from session.results import write_whole
from swimmer import CrankTurn
from synthetic.motor import Drive, SyntheticMotor, drive
from synthetic.trials import SyntheticTrial

PULSE_RAD = 2 * np.pi / 4096
SPEED_RAD_S = 0.229 * 2 * np.pi / 60
CURRENT_A = 2.69e-3
VOLTAGE_V = 0.1
_FRICTION_A = 0.25  # current at any speed
_LOAD_A_S = 1.5  # current for each rad/s that the motor lags
_SUPPLY_V = 12.1
_SUPPLY_OHM = 0.3
_WARM_C = 31.0  # temperature at the start
_WARMS_C_S = 0.08  # rise of the temperature a second


def reading_times(motor: SyntheticMotor, drive: Drive, random: np.random.Generator) -> np.ndarray:
    """Draw the (r,) times on the motor's clock, s, at which it is read, from first command to end of schedule."""
    beat_s = np.arange(float(drive.commands.time_s[0]), drive.end_s, motor.reading_s)
    late_s = random.exponential(motor.jitter_s, len(beat_s))
    return beat_s + np.minimum(late_s, 0.8 * motor.reading_s)


def read_motor(drive: Drive, time_s: np.ndarray, crank_rad: np.ndarray, random: np.random.Generator) -> MotorLog:
    """Compute the motor's readings.

    The zero of its encoder is drawn at random: nobody mounts the crank with care.

    Args:
        drive: the commands, and the turn of the shaft.
        time_s: (r,) times of the readings on the motor's clock, s.
        crank_rad: (r,) simulated angles of the shaft at these times.
        random: draws the zero of the encoder and the noise of the current.
    """
    zero_rad = 2 * np.pi * random.random()
    speed_rad_s = np.gradient(crank_rad, time_s)
    lag_rad_s = np.interp(time_s, drive.time_s, drive.reference_rad_s - drive.speed_rad_s)
    turning = np.clip(speed_rad_s / 0.1, -1.0, 1.0)
    current_a = _FRICTION_A * turning + _LOAD_A_S * lag_rad_s + CURRENT_A * random.standard_normal(len(time_s))
    voltage_v = _SUPPLY_V - _SUPPLY_OHM * np.abs(current_a)
    warm_c = _WARM_C + _WARMS_C_S * (time_s - time_s[0])
    return in_steps(time_s, crank_rad + zero_rad, speed_rad_s, current_a, voltage_v, warm_c)


def in_steps(
    time_s: np.ndarray,
    crank_rad: np.ndarray,
    speed_rad_s: np.ndarray,
    current_a: np.ndarray,
    voltage_v: np.ndarray,
    warm_c: np.ndarray,
) -> MotorLog:
    """Round (r,) values of a motor without faults to the steps in which it answers.

    Args:
        time_s: times of the readings, s.
        crank_rad: angles of the shaft.
        speed_rad_s: its speeds.
        current_a: currents.
        voltage_v: supply voltages.
        warm_c: temperatures, degrees Celsius.
    """
    return MotorLog(
        time_s=time_s,
        position_rad=PULSE_RAD * np.floor(crank_rad / PULSE_RAD),
        velocity_rad_s=SPEED_RAD_S * np.round(speed_rad_s / SPEED_RAD_S),
        current_a=CURRENT_A * np.round(current_a / CURRENT_A),
        voltage_v=VOLTAGE_V * np.round(voltage_v / VOLTAGE_V),
        temperature_c=np.round(warm_c),
        error=np.zeros(len(time_s)),
    )


def save_motor_log(path: Path, log: MotorLog) -> None:
    """Write ``<trial>.motor.csv``."""
    rows = np.column_stack([getattr(log, name) for name in MOTOR_COLUMNS])
    lines = (f"{t:.6f},{x:.6f},{v:.5f},{i:.4f},{u:.1f},{c:.0f},{e:.0f}" for t, x, v, i, u, c, e in rows + 0.0)
    write_whole(path, "\n".join([",".join(MOTOR_COLUMNS), *lines, ""]))


def save_commands(path: Path, commands: MotorCommands) -> None:
    """Write ``<trial>.commands.csv``; the motor takes speeds in steps."""
    commanded_rad_s = SPEED_RAD_S * np.round(commands.velocity_rad_s / SPEED_RAD_S) + 0.0
    rows = zip(commands.time_s, commands.part, commanded_rad_s, strict=True)
    write_whole(path, "\n".join([",".join(COMMAND_COLUMNS), *(f"{t:.6f},{part},{v:.5f}" for t, part, v in rows), ""]))


@dataclass(frozen=True, eq=False)
class TrueMotor:
    """The motor of a trial: log and commands on its clock, the steady stretch of the drive on that of the video."""

    log: MotorLog
    commands: MotorCommands
    steady_s: tuple[float, float]


@dataclass(frozen=True, eq=False)
class DrivenMotor:
    """A motor as planned and driven, whose crank is not simulated yet; `readings_s` (r,) are on its clock."""

    motor: SyntheticMotor
    drive: Drive
    readings_s: np.ndarray
    random: np.random.Generator

    @classmethod
    def of(cls, trial: SyntheticTrial, motor: SyntheticMotor, random: np.random.Generator) -> "DrivenMotor":
        """Drive the motor of a trial and draw the times of its readings."""
        driven = drive(motor, trial.commanded_hz, trial.frequency_hz, trial.phase_rad, random)
        return cls(motor, driven, reading_times(motor, driven, random), random)

    @property
    def sampled_s(self) -> np.ndarray:
        """Times (r,) at which the motor is read, on the clock of the video, s."""
        return self.motor.video(self.readings_s)

    @property
    def turn(self) -> CrankTurn:
        """The turn of the crank on the clock of the video."""
        return self.drive.turn.shifted(self.motor.clock_offset_s, self.motor.clock_rate)

    def read(self, crank_rad: np.ndarray) -> TrueMotor:
        """Build the motor's log from the simulated angle of the crank at each reading (r,), rad."""
        start_s, end_s = self.motor.video(np.array(self.drive.steady_s))
        log = read_motor(self.drive, self.readings_s, crank_rad, self.random)
        return TrueMotor(log, self.drive.commands, (float(start_s), float(end_s)))
