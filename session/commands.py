"""The speeds that a motor was commanded and when, on the clock of its log."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from session.errors import Fault, FaultCollector, did_you_mean, shown
from session.flags import Flag
from session.tables import RawTable, Row, check_time, read_log, to_numbers

COMMAND_COLUMNS = ("time_s", "part", "velocity_rad_s")
"""The header of a file of commands."""

PARTS = ("rest", "start_code", "drive", "end_code")
"""Parts of a trial that a command can belong to."""


@dataclass(frozen=True, eq=False)
class MotorCommands:
    """The k speeds that a motor was commanded to turn at.

    Attributes:
        time_s: (k,) when each was commanded, seconds on the clock of the motor's log, strictly increasing.
        part: the part of the trial that each belongs to, one of `PARTS`.
        velocity_rad_s: (k,) shaft speed, held until the next command.
        flags: what is doubtful about the file.
    """

    time_s: np.ndarray
    part: tuple[str, ...]
    velocity_rad_s: np.ndarray
    flags: tuple[Flag, ...] = ()

    def span_s(self, part: str) -> tuple[float, float] | None:
        """Find when a part begins and ends, s: from its first command to the one that follows it.

        None where the part is not there or did not end.
        """
        rows = [row for row, name in enumerate(self.part) if name == part]
        if not rows or rows[-1] + 1 == len(self.part):
            return None
        return float(self.time_s[rows[0]]), float(self.time_s[rows[-1] + 1])


def load_commands(path: Path) -> MotorCommands:
    """Read ``<trial>.commands.csv``, which `calib capture` writes next to the motor log; header `COMMAND_COLUMNS`.

    A last row cut short is left out and flagged, as in `load_motor`.

    Raises:
        InputError: every fault of the file at once.
    """
    table, flags = read_log(path, COMMAND_COLUMNS)
    faults = FaultCollector(table.file)
    faults.extend_capped(_unknown_parts(table))
    values = to_numbers(_number_parts(table), COMMAND_COLUMNS, faults)  # (k, 3)
    if not faults:
        check_time(table, values[:, 0], faults)
        lines = [table.rows[row].line for row in np.flatnonzero(np.isnan(values[:, 2]))]
        places = [f"line {line}, column 3 (velocity_rad_s)" for line in lines]
        faults.extend_capped([Fault(table.file, place, "the speed is missing", "", "rad/s") for place in places])
    if not table.rows:
        faults.add("", "too short", found="no rows", expected="at least 1")
    faults.raise_if_any()
    return MotorCommands(values[:, 0], tuple(row.cells[1] for row in table.rows), values[:, 2], flags)


def _unknown_parts(table: RawTable) -> list[Fault]:
    def fault(row: Row, name: str) -> Fault:
        place, hint = f"line {row.line}, column 2 (part)", did_you_mean(name, PARTS)
        return Fault(table.file, place, "unknown part", shown(name), "a part of a trial", PARTS, hint)

    rows = [row for row in table.rows if len(row.cells) == len(COMMAND_COLUMNS)]
    return [fault(row, row.cells[1]) for row in rows if row.cells[1] not in PARTS]


def _number_parts(table: RawTable) -> RawTable:
    """Replace the names of the parts, which have been checked, by numbers, so that the whole table can be converted."""
    rows = [Row(row.line, [*row.cells[:1], *("0" for _ in row.cells[1:2]), *row.cells[2:]]) for row in table.rows]
    return replace(table, rows=rows)
