"""Motor logs: what the motor did, on the clock of the computer that drove it."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from session.errors import FaultCollector
from session.flags import Flag
from session.shaft_position import TURN, continuous_position
from session.tables import check_time, read_log, to_numbers

_FEWEST_ROWS = 2
TICKS = 4096
"""Encoder ticks in one turn of the shaft (ROBOTIS e-Manual, XW540-T140-R)."""


@dataclass(frozen=True, eq=False)
class MotorLog:
    """A motor log of n rows; every array is (n,), nan where a value is missing, in the unit of its name.

    `time_s` is on the host's monotonic clock, strictly increasing; `position_rad` and `velocity_rad_s` are those of the
    shaft, the position continuous over whole turns; `error` has the motor's hardware error bits, as written; `flags`
    say what is doubtful.
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

_PER_TURN = {"rad": TURN, "deg": 360.0, "ticks": float(TICKS), "counts": float(TICKS), "turns": 1.0}
POSITIONS = {f"position_{unit}": TURN / of_turn for unit, of_turn in _PER_TURN.items()}
"""Names that the position may have in the header, and the size of each unit in rad."""
VELOCITIES = {f"velocity_{unit}_s": TURN / of_turn for unit, of_turn in _PER_TURN.items()} | {"velocity_rpm": TURN / 60}
"""Names that the velocity may have in the header, and the size of each unit in rad/s."""

# Registers of 32 and 16 bits are signed; read as unsigned, negative values appear above half of their range.
_RANGE = {
    "position_rad": 2.0**32 / TICKS * TURN,
    "velocity_rad_s": 2.0**32 * 0.229 * TURN / 60,
    "current_a": 2.0**16 * 2.69e-3,
}
# Position and velocity count as off by the ratio of two units where they agree with it to this relative difference.
_SAME = 0.03


def load_motor(path: Path) -> MotorLog:
    """Read a motor log, a file with the header `MOTOR_COLUMNS`, position and velocity in any of their units.

    The position is made continuous: one that stays within a turn, or was read as an unsigned number, is unwrapped;
    misread values are left out and jumps by whole turns taken out, with a flag. Rows are appended while the motor runs;
    a last row cut short by the end is left out and flagged.

    Raises:
        InputError: every fault of the file at once.
    """
    units = {"position_rad": POSITIONS, "velocity_rad_s": VELOCITIES}
    table, flags = read_log(path, MOTOR_COLUMNS, units)
    faults = FaultCollector(table.file)
    named = table.header or MOTOR_COLUMNS
    values = to_numbers(table, named, faults)  # (n, 7)
    if not faults:
        check_time(table, values[:, 0], faults)
    if len(table.rows) < _FEWEST_ROWS:
        faults.add("", "too short", found=f"{len(table.rows)} rows", expected=f"at least {_FEWEST_ROWS}")
    faults.raise_if_any()
    columns = dict(zip(MOTOR_COLUMNS, values.T, strict=True))
    for name, written in zip(MOTOR_COLUMNS, named, strict=True):
        columns[name] = _to_signed(name, columns[name] * units.get(name, {}).get(written, 1.0))
    position, velocity, time_s = columns["position_rad"], columns["velocity_rad_s"], columns["time_s"]
    _check_units(time_s, position, velocity, (named[1], named[2]), faults)
    faults.raise_if_any()
    lines = np.array([row.line for row in table.rows])
    shaft = continuous_position(time_s, position, velocity, lines, named[1], faults)
    faults.raise_if_any()
    return MotorLog(**columns | {"position_rad": shaft.position_rad}, flags=(*flags, *shaft.flags))


def _to_signed(name: str, values: np.ndarray) -> np.ndarray:
    """Return the values with those above half of an unsigned register's range moved to below 0."""
    whole = _RANGE.get(name, np.inf)
    return np.where((values >= whole / 2) & (values < whole * (1 + 1e-9)), values - whole, values)


def _check_units(
    time_s: np.ndarray, position: np.ndarray, velocity: np.ndarray, named: tuple[str, str], faults: FaultCollector
) -> None:
    """Add a fault where position and velocity differ by the ratio of two units: one is not in the unit of its name."""
    speed, moved = np.abs(velocity[1:]), np.abs(np.diff(position)) / np.diff(time_s)
    known = np.isfinite(speed) & np.isfinite(moved)
    if not known.any() or not (fast := float(np.percentile(speed[known], 90))):
        return
    moving = known & (speed > fast / 2)
    ratio = float(np.median(moved[moving]) / np.median(speed[moving]))
    other_positions = {name: POSITIONS[named[0]] / unit for name, unit in POSITIONS.items() if name != named[0]}
    other_velocities = {name: unit / VELOCITIES[named[1]] for name, unit in VELOCITIES.items() if name != named[1]}
    fits = [name for name, factor in (other_positions | other_velocities).items() if abs(ratio / factor - 1) < _SAME]
    if fits and abs(ratio - 1) > 0.5:
        faults.add(
            "line 1",
            f"{named[0]} and {named[1]} do not fit each other",
            found=f"a position that moves {ratio:.3g} times as fast as the velocity says",
            expected="each column named by the unit that it is in",
            next_step=f"If it is in that unit, name a column {' or '.join(fits)}.",
        )
