"""Plain tables of tracks: a header of names, or rows of numbers alone.

    time_s,nose_x,nose_y,nose_confidence,…                              this program's
    track,frame_idx,instance.score,nose.x,nose.y,nose.score,…           SLEAP's, File > Export Analysis CSV

https://docs.sleap.ai/latest/learnings/export-analysis/

A column is read by its name. One that is not known, but tells when, how sure, or of which animal, is asked about:
passed over, it would make what is read wrong.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from swimcal.errors import FaultCollector, did_you_mean, shown
from swimcal.tables import RawTable, Row, to_numbers
from swimcal.tracks import FASTEST_STEP_S, TIME
from tracking.foreign import ForeignTracks, refuse_space

IN_SECONDS = frozenset({TIME, "time", "t", "time (s)", "time(s)", "time [s]", "t_s", "t (s)", "seconds", "timestamp"})
IN_MILLISECONDS = frozenset({"time_ms", "t_ms", "time (ms)", "time(ms)", "time [ms]", "t (ms)", "milliseconds"})
FRAMES = frozenset({"frame", "frames", "frame_idx", "frame_index", "frame_number", "frame_no", "frame_id", "fnum", ""})
"""Names of the columns that tell when, lower case; without one the rows are the frames."""
TRACK = "track"
"""SLEAP's column of the animal's name."""

ANIMAL_SCORE = "instance.score"
"""SLEAP's column of the animal's score."""
CONFIDENCES = ("confidence", "likelihood", "score", "conf", "prob", "probability")
"""Names of a confidence; a column of one of them alone is of no marker."""
COORD_PLACES = {"x": 0, "y": 1} | dict.fromkeys((*CONFIDENCES, "p", "c", "lik", "visible"), 2)
"""The place of a column among a marker's numbers, by the end of its name."""
OF_MARKER = re.compile(r"(.+?)[_. ]([A-Za-z]+)")
"""The name of a marker's column: the marker's, and what is told of it."""
ANIMALS = frozenset(
    {"id", "animal", "animal_id", "individual", "individuals", "object", "object_id", "fish", "track_id"}
)
"""Names of columns that tell which animal a row is of, lower case."""


def read_plain(table: RawTable) -> ForeignTracks:
    """Read a table with a header of names.

    Raises:
        InputError: every fault of the file at once.
    """
    faults = FaultCollector(table.file)
    header = [name.strip() for name in table.header or ()]
    markers, when = _markers(header, faults), _when(header, table.rows)
    if not markers:
        known = f"{TIME}, and x and y of each marker: nose_x, nose_y, …"
        faults.add(table.file and "line 1", "not a header of tracks", found=shown(",".join(header)), expected=known)
    faults.raise_if_any()
    if solid := [name for name in markers if any(re.fullmatch(re.escape(name) + "[_. ][zZ]", each) for each in header)]:
        refuse_space(solid, faults)
    table = _without_names(header, table, faults)
    values = to_numbers(table, tuple(header), faults)  # (n, columns)
    faults.raise_if_any()
    lines = [f"line {row.line}" for row in table.rows]
    samples = np.full((len(values), len(markers), 3), np.nan)
    for k, columns in enumerate(markers.values()):
        for place, column in columns.items():
            samples[:, k, place] = values[:, column]
    _check_marker_columns(header, values, markers, faults)
    time_s, frame = None, np.arange(len(values), dtype=float)
    if when is not None:
        name = header[when].lower()
        if name in FRAMES:
            frame = values[:, when]
            check_frames(f"column {header[when]!r}", frame, faults)
            samples, frame, lines = _whole_frames(samples, frame, lines, TRACK in header, faults)
        else:
            time_s = values[:, when] * (1e-3 if name in IN_MILLISECONDS else 1.0)
            _check_milliseconds(header[when], values[:, when], faults)
    else:
        _check_unused(header, values, {column for columns in markers.values() for column in columns.values()}, faults)
    return ForeignTracks(table.file, "marker", tuple(markers), samples[..., :2], samples[..., 2], lines, time_s, frame)


def check_frames(column: str, frame: np.ndarray, faults: FaultCollector) -> None:
    """Check that a column that should count frames does.

    Args:
        column: the column, for the message.
        frame: (n,) its numbers.
        faults: receives what is wrong.

    Raises:
        InputError: it holds other numbers, as times do, with the faults before.
    """
    odd = frame[np.isfinite(frame) & (frame != np.rint(frame))]
    if len(odd):
        what, expected = f"{column} does not count frames", "whole numbers"
        step = f"If it tells when, name it {TIME} or time_ms by its unit."
        faults.add("line 1", what, found=f"{odd[0]:.10g}", expected=expected, next_step=step)
    faults.raise_if_any()


def _without_names(header: list[str], table: RawTable, faults: FaultCollector) -> RawTable:
    """Return the table with empty cells where it names animals, of which there may be one only."""
    for k, name in enumerate(header):
        if name == TRACK or name.lower() in ANIMALS:
            named = {row.cells[k] for row in table.rows if len(row.cells) > k} - {""}
            if name != TRACK and 1 < len(named) < max(len(table.rows) / 2, 3):  # SLEAP's tell by the frame
                some = ", ".join(sorted(named)[:4])
                step = "Keep the rows of one of them."
                faults.add("line 1", f"several animals in column {name!r}", found=some, expected="one", next_step=step)
            rows = [Row(row.line, [*row.cells[:k], "", *row.cells[k + 1 :]]) for row in table.rows]
            table = replace(table, rows=rows)
    faults.raise_if_any()
    return table


def _check_marker_columns(
    header: list[str], values: np.ndarray, markers: dict[str, dict[int, int]], faults: FaultCollector
) -> None:
    """Check that no further column of a marker, nor one for all, may tell how sure its places are.

    Args:
        header: names of the columns.
        values: (n, columns) of n rows.
        markers: columns of each marker.
        faults: receives what is wrong.

    Raises:
        InputError: one does, with the faults before.
    """
    used = {column for columns in markers.values() for column in columns.values()}
    for k in set(range(len(header))) - used:
        match = OF_MARKER.fullmatch(header[k])
        whose = match[1] if match and match[1] in markers else ""
        known = values[np.isfinite(values[:, k]), k]
        between = len(known) > 0 and 0 <= known.min() < known.max() <= 1
        if (whose and between) or header[k].lower() in CONFIDENCES:
            marker = whose or next(iter(markers))
            step = f"If it tells how sure the places are, name it {marker}_confidence, with 1 for sure; else remove it."
            what, found = f"column {header[k]!r} has no known name", f"numbers from {known.min(initial=1):.3g} on"
            faults.add("line 1", what, found=found, expected="the columns of each marker by name", next_step=step)
    faults.raise_if_any()


def _check_unused(header: list[str], values: np.ndarray, used: set[int], faults: FaultCollector) -> None:
    """Check that no unused column of a table without a known time grows from row to row, as times do.

    Args:
        header: names of the columns.
        values: (n, columns) of n rows.
        used: indices of the markers' columns.
        faults: receives what is wrong.

    Raises:
        InputError: one does, with the faults before.
    """
    for column in set(range(len(header))) - used:
        times = values[:, column]
        steps = np.diff(times[np.isfinite(times)])
        if 0 < len(times) / 2 <= len(steps) and (steps >= 0).all() and (steps > 0).mean() > 1 / 2:
            found = f"{times[0]:.10g}, {times[1]:.10g}, …"
            step = f"If it tells when, name it {TIME}, time_ms or frame by its unit; else remove it."
            what = f"column {header[column]!r} has no known name, but grows as a time does"
            faults.add("line 1", what, found=found, expected="a time under its own name", next_step=step)
    faults.raise_if_any()


def _check_milliseconds(name: str, times: np.ndarray, faults: FaultCollector) -> None:
    """Check that a column that is named so has milliseconds (n,).

    Raises:
        InputError: its frames are less apart than those of any camera, as with seconds, with the faults before.
    """
    apart = float(np.median(np.diff(times))) if len(times) > 1 else np.inf
    if name.lower() in IN_MILLISECONDS and 0 < apart < 1000 * FASTEST_STEP_S:
        found = f"frames {apart:.4g} ms apart, {1000 / apart:.4g} frames a second"
        step = "If they are seconds, name the column time_s."
        faults.add("line 1", f"column {name!r} is not in milliseconds", found=found, expected="ms", next_step=step)
    faults.raise_if_any()


def read_headerless(table: RawTable, markers: tuple[str, ...]) -> ForeignTracks:
    """Read rows of x and y of the markers, in their order.

    Args:
        table: the rows.
        markers: names of the markers.

    Raises:
        InputError: every fault of the file at once.
    """
    faults = FaultCollector(table.file)
    wide = 2 * len(markers) + 1
    if all(len(row.cells) == wide and not row.cells[-1] for row in table.rows):  # a separator ends each row
        table = replace(table, rows=[Row(row.line, row.cells[:-1]) for row in table.rows])
    first = table.rows[0].cells
    if len(first) > 2 and first in ([str(k) for k in range(len(first))], [f"{k}.0" for k in range(len(first))]):
        what, step = "the first row numbers the columns", "Remove it, or give the columns their names."
        faults.add(f"line {table.rows[0].line}", what, expected="a frame, or names", next_step=step)
        faults.raise_if_any()
    widths = {len(row.cells) for row in table.rows}
    if len(widths) == 1 and widths != {2 * len(markers)}:
        step = "Give the file a header: time_s,nose_x,nose_y,…"
        found = f"{widths.pop()} in every row"
        wanted = f"{2 * len(markers)}: x and y of the {len(markers)} markers {', '.join(markers)}"
        faults.add("", "wrong number of columns", found=found, expected=wanted, next_step=step)
        faults.raise_if_any()
    columns = tuple(f"{marker}_{axis}" for marker in markers for axis in "xy")
    values = to_numbers(table, columns, faults)
    faults.raise_if_any()
    position, lines = values.reshape(len(values), len(markers), 2), [f"line {row.line}" for row in table.rows]
    unknown = np.full(position.shape[:2], np.nan)
    return ForeignTracks(table.file, "marker", markers, position, unknown, lines, None, np.arange(len(values)))


def _markers(header: list[str], faults: FaultCollector) -> dict[str, dict[int, int]]:
    """Return the columns of each marker by coordinate: x, y, and confidence where there is one."""
    found: dict[str, dict[int, int]] = {}
    for column, name in enumerate(header):
        match = OF_MARKER.fullmatch(name)
        if match is None or match[2].lower() not in COORD_PLACES or name.lower() == ANIMAL_SCORE:
            continue
        columns, place = found.setdefault(match[1], {}), COORD_PLACES[match[2].lower()]
        if place in columns and place == COORD_PLACES["confidence"]:
            continue  # asked about later
        if place in columns:
            faults.add("line 1", f"column {name!r} is repeated", expected="one of each")
        columns.setdefault(place, column)
    return {name: columns for name, columns in found.items() if _has_place(name, found, header, faults)}


def _has_place(name: str, found: dict[str, dict[int, int]], header: list[str], faults: FaultCollector) -> bool:
    """Tell whether a marker has x and y; add a fault where it has only one of them."""
    columns = found[name]
    if {0, 1} <= columns.keys():
        return True
    if 0 in columns or 1 in columns:
        lacking, there = ("y", columns[0]) if 0 in columns else ("x", columns[1])
        taken = {header[k] for own in found.values() if {0, 1} <= own.keys() for k in own.values()} | {header[there]}
        hint = did_you_mean(header[there][:-1] + lacking, [each for each in header if each not in taken])
        faults.add("line 1", f"marker {name!r} has no {lacking}", expected="x and y", next_step=hint)
    return False


def _when(header: list[str], rows: Sequence[Row]) -> int | None:
    """Return the column of the time, or else that of the frame number; None if there is neither.

    A separator at the end of each row makes an empty column without a name, which counts nothing.
    """
    lower = [name.lower() for name in header]
    for names in (IN_SECONDS, IN_MILLISECONDS, FRAMES):
        for column, name in enumerate(lower):
            if name in names and (name or any("".join(row.cells[column : column + 1]) for row in rows)):
                return column
    return None


def _whole_frames(
    samples: np.ndarray, frame: np.ndarray, lines: list[str], of_sleap: bool, faults: FaultCollector
) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Sort the rows by frame for SLEAP, and add the frames that it left out as missing."""
    if not len(frame) or not np.array_equal(frame, np.rint(frame)):
        return samples, frame, lines
    if of_sleap and len(np.unique(frame)) < len(frame):
        step = "Delete the tracks of the others in SLEAP (Tracks > Delete …), and export again."
        faults.add("", "more than one animal in a frame", expected="one animal", next_step=step)
        faults.raise_if_any()
    order = np.argsort(frame, kind="stable") if of_sleap else np.arange(len(frame))
    samples, frame, lines = samples[order], frame[order], [lines[k] for k in order]
    span = frame[-1] - frame[0] + 1
    if not of_sleap or span == len(frame) or span > 100 * len(frame):
        return samples, frame, lines
    whole = np.full((int(span), *samples.shape[1:]), np.nan)
    rows = (frame - frame[0]).astype(int)
    whole[rows] = samples
    places = [f"frame {int(frame[0]) + k}" for k in range(int(span))]
    for row, line in zip(rows.tolist(), lines, strict=True):
        places[row] = line
    return whole, frame[0] + np.arange(span), places
