"""Tables as other programs write them: other separators, comments, an index, words for a missing number."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from session import FaultCollector
from session.tables import RawTable, Row, as_table, read_text

COMMENTS = ("#", "%", "//")
MISSING = frozenset({"na", "n/a", "#n/a", "<na>", "nan", "null", "none", "nil", "-", ".", "?"})
"""Words for a missing number, lower case."""
INDEX = frozenset({"", "unnamed: 0", "index", "row"})
"""Names of a column that only counts the rows, lower case."""


def read_foreign_table(path: Path) -> RawTable:
    """Read a table of another program, without the comments above it and a first column that counts the rows.

    Cells are separated by commas, semicolons (then numbers may have decimal commas), tabs or blanks.

    Raises:
        InputError: the file cannot be read as text, or is empty.
    """
    text = read_text(path)
    lines = list(enumerate(text.replace("\r\n", "\n").replace("\r", "\n").split("\n"), start=1))
    while lines and not lines[-1][1].strip():
        lines.pop()
    while lines and (not lines[0][1].strip() or lines[0][1].lstrip().startswith(COMMENTS)):
        lines.pop(0)
    faults = FaultCollector(str(path))
    if not lines:
        faults.add("", "the file is empty", expected="comma-separated rows of numbers")
    faults.raise_if_any()
    separator = _separator([line for _, line in lines[:5]])
    rows = [Row(number, _cells(line, separator)) for number, line in lines]
    table = as_table(str(path), rows, text.endswith(("\n", "\r")))
    return _without_index(table)


def _separator(lines: Sequence[str]) -> str | None:
    """Guess the separator of the cells from the last of the first lines; None means blanks."""
    last = lines[-1]
    if ";" in last or "\t" in last:
        return ";" if ";" in last else "\t"
    return "," if "," in last or len(last.split()) < 2 else None


def _cells(line: str, separator: str | None) -> list[str]:
    cells = [cell.strip().strip('"').strip() for cell in line.split(separator)]
    if separator != ",":
        cells = [re.sub(r"^([-+]?\d+),(\d+)", r"\1.\2", cell) for cell in cells]
    return ["" if cell.lower() in MISSING else cell for cell in cells]


def _without_index(table: RawTable) -> RawTable:
    """Drop a first column that only counts the rows, if there is a time or a frame beside it."""
    header = table.header
    if header is None or header[0].lower() not in INDEX or len(header) < 2:
        return table
    if any(row.cells[0] != str(k) and row.cells[0] != str(k + 1) for k, row in enumerate(table.rows)):
        return table
    rows = [Row(row.line, row.cells[1:]) for row in table.rows]
    return RawTable(table.file, header[1:], rows, table.ends_whole)
