"""Tables of numbers in CSV, read strictly: a cell that is not a number is reported with its line and column."""

from __future__ import annotations

import gzip
import math
import re
import zlib
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from swimcal.errors import SHOWN_PER_KIND, Fault, FaultCollector, InputError, did_you_mean, shown
from swimcal.flags import Flag

GZIP_MAGIC = b"\x1f\x8b"
EMPTY = "the file is empty"
CONTROLS = frozenset(range(9))
"""Bytes that text has none of, in any encoding of one byte a letter."""
GROUPED = re.compile(r"[-+]?[1-9]\d{0,2}([,. '\u00a0\u202f])\d{3}(?:\1\d{3})*[.,]\d+")
"""A number whose thousands are kept apart, and which has decimals: no other reading is possible."""
CLOCK = re.compile(r"\d:\d\d")
"""A time of day, or minutes and seconds."""
FILL = "Write the recording to it again, or take it out of session.toml."


@dataclass(frozen=True)
class Row:
    """One line of the file: its number, counted from 1, and its cells without the white space around them."""

    line: int
    cells: list[str]


@dataclass(frozen=True)
class RawTable:
    """The cells of a table, not yet converted to numbers.

    Attributes:
        file: name of the file for messages.
        header: the first row where it holds names, else None.
        rows: all other rows, blank ones at the end left out.
        ends_whole: whether the last line is ended by a line feed.
    """

    file: str
    header: tuple[str, ...] | None
    rows: list[Row]
    ends_whole: bool


def read_text(path: Path) -> str:
    """Read the text of a file, unpacked if it is gzip (known by its first bytes), without a byte order mark.

    Raises:
        InputError: not there, not readable, damaged, or not UTF-8.
    """
    try:
        data = path.read_bytes()
        if data.startswith(GZIP_MAGIC):
            data = gzip.decompress(data)
        return data.decode("utf-8-sig")
    except FileNotFoundError:
        fault = Fault(str(path), "", "the file is not there", expected="a readable file")
    except IsADirectoryError:
        fault = Fault(str(path), "", "this is a folder", expected="a file")
    except UnicodeDecodeError as error:
        found = f"byte {error.object[error.start]:#04x} at {error.start}"
        text = data.startswith((BOM_UTF16_LE, BOM_UTF16_BE)) or CONTROLS.isdisjoint(data[:4096])
        form = "" if path.suffix == ".toml" else "as CSV "
        step = f"Save it again {form}in UTF-8." if text else ""
        fault = Fault(str(path), "", "not a text file", found, "text in UTF-8", next_step=step)
    except (gzip.BadGzipFile, EOFError, zlib.error) as error:
        expected, step = "a whole gzip file", "Copy or pack it again."
        found = "its end is missing" if isinstance(error, EOFError) else str(error)
        fault = Fault(str(path), "", "the packed file is damaged", found, expected, next_step=step)
    except (OSError, ValueError) as error:
        fault = Fault(str(path), "", "the file cannot be read", str(error), "a readable file")
    raise InputError([fault])


def read_table(path: Path) -> RawTable:
    """Split a CSV file into cells; a first row most of whose cells are not numbers is the header.

    Raises:
        InputError: the file cannot be read as text, or is empty.
    """
    file, text = str(path), read_text(path)
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    cells = ([cell.strip().strip('"') for cell in line.split(",")] for line in lines)
    rows = [Row(number, own) for number, own in enumerate(cells, start=1)]
    while rows and rows[-1].cells == [""]:
        rows.pop()
    faults = FaultCollector(file)
    if not rows:
        faults.add("", EMPTY, expected="comma-separated rows of numbers", next_step=FILL)
    elif "," not in lines[0] and (";" in lines[0] or "\t" in lines[0]):
        step = "Save it with commas; `calib convert` does so with tracks."
        expected = "columns separated by commas"
        faults.add("line 1", "one column only", found=shown(lines[0]), expected=expected, next_step=step)
    faults.raise_if_any()
    return as_table(file, rows, text.endswith(("\n", "\r")))


def as_table(file: str, rows: list[Row], ends_whole: bool) -> RawTable:
    """Build a table from rows, of which there is at least one.

    The first row is the header where most of its cells are not numbers.
    """
    first = rows[0].cells
    has_header = sum(_read_number(cell) is None for cell in first) > len(first) / 2
    header = tuple(first) if has_header else None
    return RawTable(file, header, rows[1:] if has_header else rows, ends_whole)


def check_header(
    table: RawTable, columns: tuple[str, ...], faults: FaultCollector, others: Mapping[str, Iterable[str]]
) -> None:
    """Add a fault where the header is missing or has other columns.

    Args:
        table: the table as read.
        columns: names that the header must have, in their order.
        faults: receives what is wrong.
        others: further names of a column that count as its own.
    """
    expected = ",".join(columns)
    if table.header is None:
        faults.add("line 1", "no header", expected=expected)
        return
    column_of = {name: column for column, names in others.items() for name in names}
    if tuple(column_of.get(name, name) for name in table.header) == columns:
        return
    strange = [name for name in table.header if name not in columns and name not in column_of]
    hint = did_you_mean(strange[0], (*columns, *column_of)) if strange else ""
    for column, names in others.items():
        if strange and strange[0].split("_")[0] == column.split("_")[0]:
            hint = f"{strange[0]!r} does not say its unit; name the column by it: {', '.join(names)}."
    if strange and strange[0].split("_")[0] == "time" and "time_s" in columns:
        hint = "Write the times in seconds, and name the column time_s."
    hint = hint or "Give all columns in this order; one that was not measured may be empty."
    faults.add("line 1", "wrong header", found=",".join(table.header), expected=expected, next_step=hint)


def read_log(
    path: Path, columns: tuple[str, ...], others: Mapping[str, Iterable[str]] = MappingProxyType({})
) -> tuple[RawTable, tuple[Flag, ...]]:
    """Read a table with these columns, to which rows are appended while something runs.

    A last row cut short by the end (not ended by a line feed, or with cells missing) is left out and flagged.

    Args:
        path: the file.
        columns: names that the header must have, in their order.
        others: further names of a column, for instance one for each unit it may be in.

    Raises:
        InputError: the file cannot be read as text, is empty, or has another header.
    """
    table = read_table(path)
    faults = FaultCollector(table.file)
    check_header(table, columns, faults, others)
    faults.raise_if_any()
    # An editor, or a file system after a power loss, may have ended a cut row after all: then cells are missing.
    cut = table.rows and (not table.ends_whole or len(table.rows[-1].cells) < len(table.header or ()))
    if not cut:
        return table, ()
    message = f"line {table.rows[-1].line} is cut short and was left out; the log ended mid-row"
    return replace(table, rows=table.rows[:-1], ends_whole=True), (Flag("truncated_log", message=message),)


def to_numbers(table: RawTable, columns: tuple[str, ...], faults: FaultCollector) -> np.ndarray:
    """Convert the rows of a table to numbers, shape (rows, columns); nan for an empty or ``nan`` cell.

    Ragged rows and rows of words, which are left out, cells that are not numbers and infinite values become faults.
    Messages name the `columns`, whose number is the width expected.

    Args:
        table: the table as read.
        columns: names of the columns.
        faults: receives what is wrong.
    """
    if len(widths := {len(row.cells) for row in table.rows}) == 1 < len(table.rows) and widths != {len(columns)}:
        found, expected = f"{widths.pop()} in every row", f"{len(columns)}, as there are names"
        faults.add("", "wrong number of columns", found=found, expected=expected)
        return np.empty((0, len(columns)))
    ragged: list[Fault] = []
    bad_cells: dict[int, list[Fault]] = {}
    values: list[list[float]] = []
    for row in table.rows:
        if len(row.cells) != len(columns):
            ragged.append(_ragged(table.file, row, len(columns)))
            continue
        try:
            numbers = [float(cell) for cell in row.cells]
            plain = all(map(math.isfinite, numbers)) and "_" not in "".join(row.cells)
        except ValueError:
            plain = False
        if not plain and all(_read_number(cell) is None for cell in row.cells):
            ragged.append(_wordy(table.file, row))
            continue
        if not plain:
            numbers = [_check_cell(table.file, row, column, columns, bad_cells) for column in range(len(columns))]
        values.append(numbers)
    faults.extend_capped(ragged)
    faults.extend_capped(_cell_faults(table, columns, bad_cells))
    return np.array(values, dtype=float).reshape(len(values), len(columns))


def _cell_faults(table: RawTable, columns: tuple[str, ...], bad_cells: Mapping[int, list[Fault]]) -> list[Fault]:
    """Return the faults of all cells, by column; one only for a column that holds hardly a number."""
    found: list[Fault] = []
    for column, own in bad_cells.items():
        if len(own) <= max(SHOWN_PER_KIND, len(table.rows) / 2):
            found += own
            continue
        where, first = f"column {column + 1} ({columns[column]})", table.rows[0].cells[column]
        found.append(
            Fault(table.file, where, "hardly a number in it", shown(first), "numbers", (), _way_to_write(first))
        )
    return found


def _way_to_write(cell: str) -> str:
    """Say how a number that is written in another way is to be written; empty where the cell is none."""
    if CLOCK.search(cell):
        return "Write times in seconds, or as numbers of frames."
    return "Its thousands are kept apart: write 1024.5, not 1,024.5 nor 1.024,5." if GROUPED.fullmatch(cell) else ""


def _wordy(file: str, row: Row) -> Fault:
    found, step = shown(", ".join(row.cells)), "Remove it, if it tells units or names."
    return Fault(file, f"line {row.line}", "a row without a number", found, "numbers", next_step=step)


def check_time(table: RawTable, time_s: np.ndarray, faults: FaultCollector) -> None:
    """Add a fault for each row whose time, of shape (rows,), is missing or not later than the one before."""

    def fault(row: int, what: str, found: str) -> Fault:
        return Fault(table.file, f"line {table.rows[row].line}", what, found, "a later time in every row")

    faults.extend_capped([fault(k, "time_s is missing", "") for k in np.flatnonzero(np.isnan(time_s)).tolist()])
    late = (1 + np.flatnonzero(time_s[1:] <= time_s[:-1])).tolist()
    found = [fault(k, "time does not increase", f"{time_s[k]} after {time_s[k - 1]}") for k in late]
    step = "Remove rows that are there twice, sort the others, and write times with all their decimals."
    faults.extend_capped([*(replace(first, next_step=step) for first in found[:1]), *found[1:]])


def _read_number(cell: str) -> float | None:
    """Read the number in a cell: nan for an empty one, None where there is none."""
    if not cell:
        return math.nan
    try:
        return None if "_" in cell else float(cell)
    except ValueError:
        return None


def _ragged(file: str, row: Row, width: int) -> Fault:
    found = "a blank line" if row.cells == [""] else f"{len(row.cells)} columns"
    return Fault(file, f"line {row.line}", "wrong number of columns", found, f"{width} columns")


def _check_cell(file: str, row: Row, column: int, columns: tuple[str, ...], bad_cells: dict[int, list[Fault]]) -> float:
    """Read the number in one cell; nan, and a fault, where it is not a finite one."""
    cell = row.cells[column]
    value = _read_number(cell)
    if value is not None and not math.isinf(value):
        return value
    what = "not a number" if value is None else "an infinite value"
    where = f"line {row.line}, column {column + 1} ({columns[column]})"
    expected = "a finite number, or an empty cell for a missing sample"
    fault = Fault(file, where, what, shown(cell), expected, next_step=_way_to_write(cell))
    bad_cells.setdefault(column, []).append(fault)
    return math.nan
