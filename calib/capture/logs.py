"""The log of one trial, row by row on disk while the motor runs."""

from __future__ import annotations

import contextlib
import math
import os
from pathlib import Path
from typing import TextIO

from calib.capture import registers
from calib.capture.errors import UserError
from calib.capture.motor import Reading
from calib.capture.registers import TurnCounter

MOTOR_HEADER = "time_s,position_rad,velocity_rad_s,current_a,voltage_v,temperature_c,error"
COMMANDS_HEADER = "time_s,part,velocity_rad_s"
FEWEST_ROWS = 2
"""Number of rows that a log must have: a session takes none with fewer."""


class TrialLog:
    """The log files ``<name>.motor.csv``, what was measured, and ``<name>.commands.csv``, what was commanded and when.

    Each row is handed to the operating system at once, so that it outlives this program. Where fewer than
    `FEWEST_ROWS` were measured, both files are removed at the end.
    """

    def __init__(self, folder: Path, name: str) -> None:
        self.path = folder / f"{name}.motor.csv"
        self.rows = 0
        self.first_s = math.nan
        self.last_s = -math.inf
        self._steady: list[tuple[float, int]] = []  # times (s) and positions (pulses) of the first and last steady row
        self._commands_path = folder / f"{name}.commands.csv"
        self._position = TurnCounter(2**32)
        self._motor: TextIO | None = None
        self._commands: TextIO | None = None

    def __enter__(self) -> TrialLog:
        try:
            self._motor = _start_file(self.path, MOTOR_HEADER)
            self._commands = _start_file(self._commands_path, COMMANDS_HEADER)
        except UserError:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        for file in (self._motor, self._commands):
            if file is not None:
                _close(file)
                if self.rows < FEWEST_ROWS:
                    Path(file.name).unlink(missing_ok=True)

    def measured(self, reading: Reading, steady: bool) -> None:
        """Add a row of what was measured.

        A row whose time is unsure, or not later than the last, is left out. The mean speed is that of the `steady`
        rows.
        """
        time_s = round(reading.time_s, 6)
        value = reading.measured
        position = self._position.follow(value.position)
        if time_s <= self.last_s or not reading.timely:
            return
        assert self._motor is not None
        _append(
            self._motor,
            f"{time_s:.6f},{2 * math.pi * position / registers.PULSES:.6f},{registers.rad_per_s(value.velocity):.5f},"
            f"{value.current * registers.AMPERE:.4f},{value.voltage * registers.VOLT:.1f},{value.temperature},"
            f"{reading.hardware_error}",
        )
        self.first_s = time_s if self.rows == 0 else self.first_s
        self.last_s = time_s
        self.rows += 1
        if steady:
            self._steady = [*self._steady[:1], (reading.time_s, position)]

    def commanded(self, time_s: float, part: str, units: int) -> None:
        """Add a row of what was commanded.

        Args:
            time_s: when the motor got the command, s.
            part: the part of the trial, such as "drive".
            units: the goal velocity in its own units.
        """
        assert self._commands is not None
        _append(self._commands, f"{time_s:.6f},{part},{registers.rad_per_s(units):.5f}")

    @property
    def mean_hz(self) -> float:
        """Turns a second between the first and the last steady row; nan with fewer than two."""
        if len(self._steady) < 2:
            return math.nan
        (first_s, first), (last_s, last) = self._steady
        return (last - first) / registers.PULSES / (last_s - first_s)

    @property
    def rate_hz(self) -> float:
        """Rows a second; nan with fewer than two."""
        return (self.rows - 1) / (self.last_s - self.first_s) if self.rows >= FEWEST_ROWS else math.nan


def _start_file(path: Path, header: str) -> TextIO:
    try:
        file = path.open("x", encoding="utf-8", newline="\n")
    except OSError as error:
        raise UserError(f"{path}: cannot be written; found: {error.strerror or error}") from error
    _append(file, header)
    return file


def _append(file: TextIO, row: str) -> None:
    try:
        file.write(row + "\n")
        file.flush()
    except OSError as error:
        raise UserError(
            f"{file.name}: cannot be written; found: {error.strerror or error}. Is the disk full?"
        ) from error


def _close(file: TextIO) -> None:
    """Close the file, with its content on the disk itself, should the power go next."""
    with contextlib.suppress(OSError):  # a full disk was reported when the row was written
        file.flush()
        os.fsync(file.fileno())
    with contextlib.suppress(OSError):
        file.close()
