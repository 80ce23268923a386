"""Motor logs: what the motor did, on the clock of the computer that drove it."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from session.errors import FaultCollector
from session.flags import Flag
from session.tables import check_time, read_log, to_numbers

_FEWEST_ROWS = 2


@dataclass(frozen=True, eq=False)
class MotorLog:
    """A motor log of n rows; every array is (n,), nan where a value is missing, in the unit of its name.

    `time_s` is on the host's monotonic clock, strictly increasing; `position_rad` and `velocity_rad_s` are those of the
    shaft; `error` has the motor's hardware error bits, as written; `flags` say what is doubtful.
    """

    time_s: np.ndarray
    position_rad: np.ndarray
    velocity_rad_s: np.ndarray
    current_a: np.ndarray
    voltage_v: np.ndarray
    temperature_c: np.ndarray
    error: np.ndarray
    flags: tuple[Flag, ...] = ()


MOTOR_COLUMNS = tuple(field.name for field in fields(MotorLog) if field.name != "flags")
"""The header of a motor log."""


def load_motor(path: Path) -> MotorLog:
    """Reads a motor log, a file with the header `MOTOR_COLUMNS`.

    Rows are appended while the motor runs; a last row cut short by the end is left out and flagged.

    Raises:
        InputError: every fault of the file at once.
    """
    table, flags = read_log(path, MOTOR_COLUMNS)
    faults = FaultCollector(table.file)
    values = to_numbers(table, MOTOR_COLUMNS, faults)  # (n, 7)
    if not faults:
        check_time(table, values[:, 0], faults)
    if len(table.rows) < _FEWEST_ROWS:
        faults.add("", "too short", found=f"{len(table.rows)} rows", expected=f"at least {_FEWEST_ROWS}")
    faults.raise_if_any()
    return MotorLog(**dict(zip(MOTOR_COLUMNS, values.T, strict=True)), flags=flags)
