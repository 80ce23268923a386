"""Tables of tracks with a header of names: this program's, SLEAP's, and others with x and y of each marker.

    time_s,nose_x,nose_y,nose_confidence,…
    track,frame_idx,instance.score,nose.x,nose.y,nose.score,…           SLEAP, File > Export Analysis CSV

https://docs.sleap.ai/latest/learnings/export-analysis/
"""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from session import FaultCollector
from session.errors import did_you_mean, shown
from session.tables import RawTable, Row, to_numbers
from session.tracks import TIME
from tracking.records.foreign import ForeignTracks

IN_SECONDS = frozenset({TIME, "time", "t", "time (s)", "time(s)", "time [s]", "t_s", "t (s)", "seconds", "timestamp"})
IN_MILLISECONDS = frozenset({"time_ms", "t_ms", "time (ms)", "time(ms)", "time [ms]", "t (ms)", "milliseconds"})
FRAMES = frozenset({"frame", "frames", "frame_idx", "frame_index", "frame_number", "frame_no", "frame_id", "fnum", ""})
"""Names of the columns that tell when, lower case; without one the rows are the frames."""
TRACK = "track"
"""SLEAP's column of the animal's name."""

ANIMAL_SCORE = "instance.score"
"""SLEAP's column of the animal's score."""
COORDS = {"x": 0, "y": 1, "confidence": 2, "likelihood": 2, "score": 2, "conf": 2, "prob": 2}
"""The place of a column among a marker's numbers, by the end of its name."""


def read_plain(table: RawTable) -> ForeignTracks:
    """Read a table with a header of names.

    Raises:
        InputError: every fault of the file at once.
    """
    faults = FaultCollector(table.file)
    header = [name.strip() for name in table.header or ()]
    markers, when = _markers(header, faults), _when(header)
    if not markers:
        known = f"{TIME}, and x and y of each marker: nose_x, nose_y, …"
        faults.add(table.file and "line 1", "not a header of tracks", found=shown(",".join(header)), expected=known)
    faults.raise_if_any()
    values = to_numbers(_blank_words(table, header), tuple(header), faults)  # (n, columns)
    faults.raise_if_any()
    lines = [f"line {row.line}" for row in table.rows]
    samples = np.full((len(values), len(markers), 3), np.nan)
    for k, columns in enumerate(markers.values()):
        for place, column in columns.items():
            samples[:, k, place] = values[:, column]
    time_s, frame = None, np.arange(len(values), dtype=float)
    if when is not None:
        name = header[when].lower()
        if name in FRAMES:
            frame = values[:, when]
            samples, frame, lines = _whole_frames(samples, frame, lines, TRACK in header, faults)
        else:
            time_s = values[:, when] * (1e-3 if name in IN_MILLISECONDS else 1.0)
    return ForeignTracks(table.file, "marker", tuple(markers), samples[..., :2], samples[..., 2], lines, time_s, frame)


def _markers(header: list[str], faults: FaultCollector) -> dict[str, dict[int, int]]:
    """Return the columns of each marker by coordinate: x, y, and confidence where there is one."""
    found: dict[str, dict[int, int]] = {}
    for column, name in enumerate(header):
        match = re.fullmatch(r"(.+?)[_. ]([A-Za-z]+)", name)
        if match is None or match[2].lower() not in COORDS or name.lower() == ANIMAL_SCORE:
            continue
        columns, place = found.setdefault(match[1], {}), COORDS[match[2].lower()]
        if place in columns:
            faults.add("line 1", f"column {name!r} is repeated", expected="one of each")
        columns.setdefault(place, column)
    return {name: columns for name, columns in found.items() if _has_place(name, columns, header, faults)}


def _has_place(name: str, columns: dict[int, int], header: list[str], faults: FaultCollector) -> bool:
    """Tell whether a marker has x and y; add a fault where it has only one of them."""
    if {0, 1} <= columns.keys():
        return True
    if 0 in columns or 1 in columns:
        lacking, there = ("y", columns[0]) if 0 in columns else ("x", columns[1])
        hint = did_you_mean(header[there][:-1] + lacking, [each for each in header if each != header[there]])
        faults.add("line 1", f"marker {name!r} has no {lacking}", expected="x and y", next_step=hint)
    return False


def _when(header: list[str]) -> int | None:
    """Return the column of the time, or else that of the frame number; None if there is neither."""
    lower = [name.lower() for name in header]
    for names in (IN_SECONDS, IN_MILLISECONDS, FRAMES):
        for column, name in enumerate(lower):
            if name in names:
                return column
    return None


def _blank_words(table: RawTable, header: list[str]) -> RawTable:
    """Blank the words in a column that holds no numbers: the name of SLEAP's track."""
    if TRACK not in header:
        return table
    k = header.index(TRACK)
    return replace(table, rows=[Row(row.line, [*row.cells[:k], "", *row.cells[k + 1 :]]) for row in table.rows])


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


def read_headerless(table: RawTable, markers: tuple[str, ...]) -> ForeignTracks:
    """Read rows of x and y of the markers, in their order.

    Args:
        table: the rows.
        markers: names of the markers.

    Raises:
        InputError: every fault of the file at once.
    """
    faults = FaultCollector(table.file)
    widths = {len(row.cells) for row in table.rows}
    if len(widths) == 1 and widths != {2 * len(markers)}:
        step = "Give the file a header: time_s,nose_x,nose_y,…"
        found, wanted = (
            f"{widths.pop()} in every row",
            f"{2 * len(markers)}: x and y of the {len(markers)} markers {', '.join(markers)}",
        )
        faults.add("", "wrong number of columns", found=found, expected=wanted, next_step=step)
        faults.raise_if_any()
    columns = tuple(f"{marker}_{axis}" for marker in markers for axis in "xy")
    values = to_numbers(table, columns, faults)
    faults.raise_if_any()
    position, lines = values.reshape(len(values), len(markers), 2), [f"line {row.line}" for row in table.rows]
    unknown = np.full(position.shape[:2], np.nan)
    return ForeignTracks(table.file, "marker", markers, position, unknown, lines, None, np.arange(len(values)))
