"""A motor in its trial: driven before the simulation, which follows its turn, and read after it."""

from dataclasses import dataclass

import numpy as np

from session.commands import MotorCommands
from session.motor import MotorLog
from swimmer import CrankTurn
from synthetic.motor import Drive, SyntheticMotor, drive
from synthetic.motor_log import read_motor, reading_times
from synthetic.trials import SyntheticTrial


@dataclass(frozen=True, eq=False)
class TrueMotor:
    """The motor of a trial.

    Attributes:
        log: its readings, on its clock.
        commands: what it was told, and when, on its clock.
        steady_s: the steady stretch of the drive, on the clock of the video.
    """

    log: MotorLog
    commands: MotorCommands
    steady_s: tuple[float, float]


@dataclass(frozen=True, eq=False)
class DrivenMotor:
    """A motor whose crank is not simulated yet.

    Attributes:
        motor: as planned.
        drive: what it was told and how it turns.
        readings_s: (r,) when it is read, on its clock.
        random: source of what is random in its log.
    """

    motor: SyntheticMotor
    drive: Drive
    readings_s: np.ndarray
    random: np.random.Generator

    @classmethod
    def of(cls, trial: SyntheticTrial, motor: SyntheticMotor, random: np.random.Generator) -> "DrivenMotor":
        """The motor of a trial."""
        driven = drive(motor, trial.commanded_hz, trial.frequency_hz, trial.phase_rad, random)
        return cls(motor, driven, reading_times(motor, driven, random), random)

    @property
    def looks_s(self) -> np.ndarray:
        """(r,) when it is read, on the clock of the video."""
        return self.motor.video(self.readings_s)

    @property
    def turn(self) -> CrankTurn:
        """Of the crank, on the clock of the video."""
        return self.drive.turn.shifted(self.motor.clock_offset_s, self.motor.clock_rate)

    def read(self, crank_rad: np.ndarray) -> TrueMotor:
        """The motor and its log, from where the simulated crank was at each reading (r,)."""
        start_s, end_s = self.motor.video(np.array(self.drive.steady_s))
        log = read_motor(self.drive, self.readings_s, crank_rad, self.random)
        return TrueMotor(log, self.drive.commands, (float(start_s), float(end_s)))
