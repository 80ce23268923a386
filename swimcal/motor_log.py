"""Logs of the motor: commanded and measured turns of the shaft over time.

`MotorCommands` are the speeds that the motor was commanded and when, `MotorLog` what it then did; both are on the clock
of the computer that drove it.

`continuous_position` makes the position of the shaft one continuous angle, whatever counter it was logged from. A
servo's shaft cannot make half a turn between two readings some 10 ms apart: jumps by whole turns come from the counter.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from swimcal.errors import Fault, FaultCollector, did_you_mean, shown
from swimcal.flags import Flag
from swimcal.tables import RawTable, Row, check_time, read_log, to_numbers

COMMAND_COLUMNS = ("time_s", "part", "velocity_rad_s")
"""The header of a file of commands."""

PARTS = ("rest", "start_code", "drive", "end_code")
"""Parts of a trial that a command can belong to."""

TURN = 2 * np.pi

# Readings of a running median: up to four misread ones in a row are recognised.
_WINDOW = 9
# A reading may be away from its neighbours by this, turns, in addition to what the shaft turns meanwhile.
_OFF_TURNS = 0.1
# A position that stays within this range, turns, and jumps is logged as 0 to 1 or -1/2 to 1/2 turn.
_ONE_TURN = 1.01
# Share of steps beyond half a turn: above it, the shaft itself makes them between two readings.
_SPARSE_SHARE = 0.3
# Turns between two readings above which it cannot be told which way round the shaft went.
_AMBIGUOUS = 0.4
# Readings further apart than this, s, are of times in another unit: a motor is read many times a second.
_SELDOM = 5.0
# Readings further apart than this, s, make their unit doubtful.
_SLOW = 0.5
# Slowest crank, rad/s, that is believed where the unit is doubtful.
_CREEPING = 0.02 * TURN
_PER_SECOND = (1e3, 1e6, 1e9)
# Readings count as missing where two are further apart than this many times the usual spacing.
_GAP = 3.0

_FEWEST_ROWS = 2
TICKS = 4096
"""Encoder ticks in one turn of the shaft (ROBOTIS e-Manual, XW540-T140-R)."""

_PER_TURN = {"rad": TURN, "deg": 360.0, "ticks": float(TICKS), "counts": float(TICKS), "turns": 1.0}
POSITIONS = {f"position_{unit}": TURN / of_turn for unit, of_turn in _PER_TURN.items()}
"""Names that the position may have in the header, and the size of each unit in rad."""
VELOCITIES = {f"velocity_{unit}_s": TURN / of_turn for unit, of_turn in _PER_TURN.items()} | {"velocity_rpm": TURN / 60}
"""Names that the velocity may have in the header, and the size of each unit in rad/s."""

SPEED_RAD_S = 0.229 * TURN / 60
"""Unit of the motor's register of velocity, rad/s (ROBOTIS e-Manual, XW540-T140-R)."""
CURRENT_A = 2.69e-3
"""Unit of its register of current, A."""

# Registers of 32 and 16 bits are signed; read as unsigned, negative values appear above half of their range.
_RANGE = {
    "position_rad": 2.0**32 / TICKS * TURN,
    "velocity_rad_s": 2.0**32 * SPEED_RAD_S,
    "current_a": 2.0**16 * CURRENT_A,
}
# Position and velocity count as off by the ratio of two units where they agree with it to this relative difference.
_SAME = 0.03
# Position and velocity that differ by this factor are not those of one shaft, or one is the number of a register.
_FAR_APART = 4.0
# More readings than lie between two renewals of a register.
_READINGS = 16


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
    # Numbers stand for the names of the parts, which have been checked.
    rows = [Row(row.line, [*row.cells[:1], *("0" for _ in row.cells[1:2]), *row.cells[2:]]) for row in table.rows]
    values = to_numbers(replace(table, rows=rows), COMMAND_COLUMNS, faults)  # (k, 3)
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
        values, whole = columns[name] * units.get(name, {}).get(written, 1.0), _RANGE.get(name, np.inf)
        unsigned = (values >= whole / 2) & (values < whole * (1 + 1e-9))
        columns[name] = np.where(unsigned, values - whole, values)
    position, velocity, time_s = columns["position_rad"], columns["velocity_rad_s"], columns["time_s"]
    _check_units(time_s, position, velocity, (named[1], named[2]), faults)
    faults.raise_if_any()
    lines = np.array([row.line for row in table.rows])
    shaft = continuous_position(time_s, position, velocity, lines, named[1], faults)
    faults.raise_if_any()
    return MotorLog(**columns | {"position_rad": shaft.position_rad}, flags=(*flags, *shaft.flags))


def _check_units(
    time_s: np.ndarray, position: np.ndarray, velocity: np.ndarray, named: tuple[str, str], faults: FaultCollector
) -> None:
    """Add a fault where position and velocity differ by the ratio of two units: one is not in the unit of its name.

    Times in another unit than seconds make them differ too, and readings lie far apart.
    """
    spacing = float(np.median(np.diff(time_s)))
    speed, moved = np.abs(velocity[1:]), np.abs(np.diff(position)) / np.diff(time_s)
    known = np.isfinite(speed) & np.isfinite(moved)
    creeps = not known.any() and (moved > 0).any() and np.median(moved[moved > 0]) < _CREEPING
    if spacing > _SELDOM or (spacing > _SLOW and creeps):
        _add_other_time(faults, f"a reading every {spacing:.3g} s")
        return
    if not known.any() or not (fast := float(np.percentile(speed[known], 90))):
        return
    moving = known & (speed > fast / 2)
    ratio = float(np.median(moved[moving]) / np.median(speed[moving]))
    milliseconds = spacing > _SLOW and 1 / 3 < 1e3 * ratio < 3  # a gear, or a rough velocity
    if milliseconds or any(abs(ratio * factor - 1) < _SAME for factor in _PER_SECOND):
        found = f"a position that moves {ratio:.3g} times as fast as the velocity says, a reading every {spacing:.3g} s"
        _add_other_time(faults, found)
        return
    other_positions = {name: POSITIONS[named[0]] / unit for name, unit in POSITIONS.items() if name != named[0]}
    other_velocities = {name: unit / VELOCITIES[named[1]] for name, unit in VELOCITIES.items() if name != named[1]}
    fits = [name for name, factor in (other_positions | other_velocities).items() if abs(ratio / factor - 1) < _SAME]
    way = _way_turned(time_s, position, velocity, fast / 2)
    apart = np.ptp(position[np.isfinite(position)]) > TURN and not 1 / _FAR_APART < way < _FAR_APART
    if (fits and abs(ratio - 1) > 0.5) or apart:
        step = f"If it is in that unit, name a column {' or '.join(fits)}." if fits else "Leave the wrong one empty."
        faults.add(
            "line 1",
            f"{named[0]} and {named[1]} do not fit each other",
            found=f"a position that moves {way if apart else ratio:.3g} times as fast as the velocity says",
            expected="each column named by the unit that it is in",
            next_step=step,
        )


def _way_turned(time_s: np.ndarray, position: np.ndarray, velocity: np.ndarray, least_rad_s: float) -> float:
    """Return the speed by its positions (n,), rad, of a shaft that turns, over that by its velocity (n,), rad/s.

    It is 1 where no stretch of readings is as fast as `least_rad_s`.
    """
    if len(time_s) <= _READINGS:
        return 1.0
    turned = np.abs(position[_READINGS:] - position[:-_READINGS]) / (time_s[_READINGS:] - time_s[:-_READINGS])
    said = np.abs(sliding_window_view(velocity, _READINGS + 1).mean(axis=1))
    turns = np.isfinite(turned) & (said > least_rad_s)
    return float(np.median(turned[turns] / said[turns])) if turns.any() else 1.0


def _add_other_time(faults: FaultCollector, found: str) -> None:
    faults.add(
        "",
        "time_s is not in seconds",
        found=found,
        expected="seconds, in the motor log and in its commands",
        next_step="Divide times in milliseconds by 1000.",
    )


class ShaftPosition(NamedTuple):
    """Continuous position (n,) of a shaft, rad, and flags; nan where missing, misread or not renewed."""

    position_rad: np.ndarray
    flags: tuple[Flag, ...]


def continuous_position(
    time_s: np.ndarray,
    position_rad: np.ndarray,
    velocity_rad_s: np.ndarray,
    lines: np.ndarray,
    column: str,
    faults: FaultCollector,
) -> ShaftPosition:
    """Take out misread positions, and the whole turns by which a counter jumps.

    A position that stays within one turn is unwrapped. Single readings away from their neighbours are left out and
    flagged. Where a counter jumps by whole turns and stays there, the turns are taken out and flagged; where it is read
    too seldom to tell, they stay.

    Args:
        time_s: (n,) times of the readings, s, increasing.
        position_rad: (n,) positions as logged, rad; nan where missing.
        velocity_rad_s: (n,) speeds as logged, rad/s; nan where missing.
        lines: (n,) numbers of their lines in the file.
        column: the position's name in the file.
        faults: receives a fault where a position within one turn is read too seldom to be unwrapped.
    """
    seen = np.flatnonzero(np.isfinite(position_rad))
    seen = seen[_fresh(position_rad[seen])]
    if len(seen) < _WINDOW:
        farthest = np.abs(np.diff(position_rad[seen])).max(initial=0.0)
        if farthest > TURN / 2 and np.ptp(position_rad[seen]) <= _ONE_TURN * TURN:
            _add_too_seldom(faults, column, f"{len(seen)} different readings")
        return ShaftPosition(position_rad, ())
    turns, times = position_rad[seen] / TURN, time_s[seen]
    gaps = np.flatnonzero(np.diff(times) > _GAP * np.median(np.diff(times))) + 1
    near = np.concatenate([_running_median(stretch) for stretch in np.split(turns, gaps)])
    step = np.diff(turns)  # where the shaft is fast; jumps of the counter do not count
    usual = float(max(np.percentile(np.abs(step - np.round(step)), 90), np.median(np.abs(step))))
    off = _OFF_TURNS + 1.5 * _WINDOW / 2 * usual
    strange = np.abs(turns - near) > off
    within = turns[~strange]
    one_turn = bool(np.ptp(within) <= _ONE_TURN)
    if one_turn:  # a shaft that rests where the counter wraps reads either end
        whole = np.abs(turns - near - np.round(turns - near)) <= off
        strange &= ~(whole & (turns > within.max() - _ONE_TURN) & (turns < within.min() + _ONE_TURN))
    kept = np.flatnonzero(~strange)
    jumps = _jumps(times[kept], turns[kept], one_turn)
    step = np.diff(turns[kept])
    half = bool(np.percentile(np.abs(step - np.round(step)), 95) > _AMBIGUOUS)
    share = float(np.mean(jumps != 0))
    known = np.isfinite(velocity_rad_s).mean() > 0.5
    between = np.nanmedian(np.abs(velocity_rad_s)) / TURN * np.median(np.diff(times)) if known else 0.0
    if one_turn and (half or share > _SPARSE_SHARE or (share > 0 and between > 0.5)):
        _add_too_seldom(faults, column, f"a reading every {np.median(np.diff(times)):.2g} s")
        return ShaftPosition(position_rad, ())
    mended = np.full(len(position_rad), np.nan)
    if half or share > _SPARSE_SHARE:
        jumps = np.zeros_like(jumps)
    mended[seen[kept]] = position_rad[seen[kept]] - TURN * np.concatenate([[0.0], np.cumsum(jumps)])
    log = Path(faults.file).name
    flags = _flag_misread(log, lines[seen[strange]], (turns - near)[strange])
    return ShaftPosition(mended, flags if one_turn else (*flags, *_flag_jumps(log, lines[seen[kept[1:]]], jumps)))


def _add_too_seldom(faults: FaultCollector, column: str, found: str) -> None:
    what = f"{column} stays within one turn and is read too seldom to tell how far the shaft turned in between"
    faults.add("", what, found=found, expected="a few readings a turn, or a position that counts on over whole turns")


def _fresh(position: np.ndarray) -> np.ndarray:
    """Select readings of a register that is renewed less often than it is read: (n,) True where it may be new.

    Between two renewals the same value is read again, though the shaft turns on. Of a value that is read for longer,
    because the shaft rests, every m-th reading counts, where nine of ten values are read at most m times.
    """
    starts = np.flatnonzero(np.concatenate([[True], np.diff(position) != 0]))
    lengths = np.diff(np.append(starts, len(position)))
    usual = int(np.percentile(lengths, 90))
    since = np.arange(len(position)) - np.repeat(starts, lengths)
    return np.asarray(since % usual == 0)


def _running_median(values: np.ndarray) -> np.ndarray:
    from scipy.ndimage import median_filter  # a fifth of a second, for which reading a session need not wait

    return np.asarray(median_filter(values, _WINDOW, mode="mirror"))


def _running_sum(values: np.ndarray) -> np.ndarray:
    return np.convolve(values, np.ones(min(_WINDOW, len(values))), mode="same")


def _jumps(times: np.ndarray, turns: np.ndarray, one_turn: bool) -> np.ndarray:
    """Estimate the (k - 1,) whole turns by which the counter jumps from each reading to the next.

    A position within one turn is taken to have come as far over missing readings as the mean of the speeds before and
    after them says. One that counts on is believed as far as the shaft can have come at any speed of the log.
    """
    step, spacing = np.diff(turns), np.diff(times)
    regular = spacing <= _GAP * np.median(spacing)
    turned, passed = (_running_sum(values[regular]) for values in (step - np.round(step), spacing))
    speed = np.interp(np.arange(len(step)), np.flatnonzero(regular), turned / passed)
    before, after = np.concatenate([speed[:1], speed[:-1]]), np.concatenate([speed[1:], speed[-1:]])
    low, high = np.minimum(before, after), np.maximum(before, after)
    jumps = np.round(step - spacing * (low + high) / 2)
    low, high = (np.where(regular, own, any_) for own, any_ in ((low, speed.min()), (high, speed.max())))
    possible = (step > spacing * np.minimum(low, 0.0) - 0.5) & (step < spacing * np.maximum(high, 0.0) + 0.5)
    return np.where(possible & (not one_turn), 0.0, jumps)


def _flag_misread(log: str, lines: np.ndarray, off_turns: np.ndarray) -> tuple[Flag, ...]:
    if not len(lines):
        return ()
    several, first = "s" * (len(lines) > 1), off_turns[0]
    how_far = f"{first:+.0f}" if abs(first - round(first)) < _OFF_TURNS else f"{first:+.1f}"
    message = (
        f"{len(lines)} single reading{several} of the motor's position (line{several} {_list_lines(lines)} of {log}) "
        f"cannot be, the first is {how_far} turns off its neighbours; left out, and the crank is taken to turn "
        "smoothly there"
    )
    return (Flag("misread_position", message=message),)


def _flag_jumps(log: str, lines: np.ndarray, jumps: np.ndarray) -> tuple[Flag, ...]:
    at = np.flatnonzero(jumps)
    if not len(at):
        return ()
    message = (
        f"the motor's position jumps by {', '.join(f'{turns:+.0f}' for turns in jumps[at][:4])}"
        f"{' ...' if len(at) > 4 else ''} turns at line {_list_lines(lines[at])} of {log} and stays there, as after "
        "a restart of the motor; these turns are taken out"
    )
    return (Flag("position_jump", message=message),)


def _list_lines(lines: np.ndarray) -> str:
    shown = ", ".join(str(line) for line in lines[:6])
    return shown if len(lines) <= 6 else f"{shown} ... {lines[-1]}"
