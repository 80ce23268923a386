"""Tracks of other programs: read as tables, with an even clock, and checked.

`read_foreign_table` reads tables as other programs write them: other separators, comments, an index, words for a
missing number. `even_times` makes times that were rounded when they were written even again, where that is certain;
`with_even_clock` those of frames that were stamped late or by a clock that was set, where the motion shows it.
`ForeignTracks` checks and converts the samples; each fault names its place in the file.
"""

from __future__ import annotations

import csv
import re
import shlex
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from swimcal.errors import Fault, FaultCollector, InputError, did_you_mean
from swimcal.flags import Flag
from swimcal.results import write_whole
from swimcal.session_file import HEAD_MARKERS
from swimcal.tables import RawTable, Row, as_table, read_text
from swimcal.tracks import (
    FARTHEST_PX,
    NO_NAMES,
    SURELY_ABOVE,
    as_tracks,
    check_count,
    check_percent,
    check_pixels,
    check_seconds,
    check_seen,
    check_summary,
    markers_of,
    pixels_of,
)

# Times.
COARSE = 0.25
"""Share of a frame beyond which rounded times no longer give the distance of single frames."""
SPAN = 60
"""Frames over which the frame rate is first measured."""
UNEVEN = 0.1
"""Standard deviation of the time steps, relative to their median, from which the motion tells whether they are true."""
AROUND_STEP = 5
"""Frames from before to after a step, over which the usual motion is taken."""
CLOCK_SET = 4.0
"""Steps longer than so many usual ones, in which no marker goes further, are those of a clock that was set."""
UNTRUE = 0.3
"""Share of a step's own length that the motion in it may show, where stamps are not true: of true ones it shows all."""

# Tables.
COMMENTS = ("#", "%", "//", "sep=")
"""Beginnings of lines above a table; the last is for Excel."""
MISSING = frozenset({"na", "n/a", "#n/a", "<na>", "nan", "null", "none", "nil", "-", ".", "?"})
"""Words for a missing number, lower case."""
DECIMAL_COMMA = re.compile(r"^([-+]?\d+),(\d+)(?=[eE]|$)")
MAYBE_GROUPED = re.compile(r"[-+]?[1-9]\d{0,2}\.\d{3}")
"""A number with decimals, or one whose thousands are kept apart, if all others of its column are whole."""
MOST_ABOVE = 30
"""Lines of settings that may stand above a table."""
INDEX = frozenset({"", "unnamed: 0", "index", "row"})
"""Names of a column that only counts the rows, lower case."""


def refuse_space(markers: Sequence[str], faults: FaultCollector) -> None:
    """Refuse places in space, of which no picture tells the pixels.

    Raises:
        InputError: always, with the faults before.
    """
    step = "Give the two coordinates in pixels that one camera saw."
    what, found = "places in space, in three coordinates", f"z of {', '.join(markers[:3])}"
    faults.add("", what, found=found, expected="x and y in pixels", next_step=step)
    faults.raise_if_any()


def even_times(time_s: np.ndarray, fps: float | None, file: str) -> np.ndarray:
    """Return the frame times (n,), made even where they are coarsely rounded times of an even clock.

    Frames that are left out stay out.

    Args:
        time_s: (n,) times, s.
        fps: the frame rate, where it is known.
        file: the name of the file for messages.

    Raises:
        InputError: coarse times that are those of no even clock, and no `fps`.
    """
    step_s, rounded_s = float(np.median(np.diff(time_s))), _rounding(time_s)
    if rounded_s < COARSE * step_s:
        return time_s
    since_s = time_s - time_s[0]
    span = min(SPAN, len(time_s) - 1)
    rates = (len(time_s) - 1) / since_s[-1], float(span / np.median(since_s[span:] - since_s[:-span]))
    for rate in (*rates, *((fps,) if fps else ())):  # at a wrong rate, frames would seem to be left out
        frame = np.rint(since_s * rate)
        off_s = float(np.abs(since_s - frame / rate).max())
        if (np.diff(frame) < 1).any() or off_s > 1.01 * rounded_s:
            continue
        if off_s < 1e-3 * step_s:  # even as they are
            return time_s
        if rate != fps:
            rate = float((frame @ frame) / (frame @ since_s))
        return np.asarray(time_s[0] + frame / rate)
    if fps is not None:
        return time_s
    found = f"steps of {np.diff(time_s).min():.4g} to {np.diff(time_s).max():.4g} s, rounded to {rounded_s:g} s"
    what, step = "the times are too coarse to tell the frame rate", "Give the frame rate of the camera: add `--fps 60`."
    raise InputError([Fault(file, "", what, found, "an even clock, or finer times", next_step=step)])


def with_even_clock(tracks: xr.Dataset) -> tuple[xr.Dataset, tuple[Flag, ...]]:
    """Make the clock of tracks even, with a flag, where time stamps are uneven and the motion of the markers is not.

    A program that stamps frames when they arrive gives such stamps, and a clock that is set while it runs. In a step
    that truly takes longer the markers go further; frames that were lost are true steps, too.

    Args:
        tracks: the tracks.
    """
    time_s, position_px = tracks.time.values, pixels_of(tracks)
    steps_s, half = np.diff(time_s), AROUND_STEP // 2
    step_s = float(np.median(steps_s)) if len(steps_s) else 0.0
    if len(time_s) < SPAN // 2 or steps_s.std() < UNEVEN * step_s:
        return tracks, ()
    # Of each step but the first and last few: its motion, the usual one, and how the latter changes with true stamps.
    moved_px, usual_px = np.diff(position_px, axis=0)[half:-half], _over(position_px, AROUND_STEP) / AROUND_STEP
    longer = steps_s[half:-half] / (_over(time_s, AROUND_STEP) / AROUND_STEP) - 1
    expected_px, found_px = usual_px * longer[:, None, None], moved_px - usual_px
    seen = np.isfinite(expected_px) & np.isfinite(found_px)
    squares = float((expected_px[seen] ** 2).sum())
    share = float((expected_px[seen] * found_px[seen]).sum()) / max(squares, 1e-12)
    error = AROUND_STEP * float((found_px[seen] - share * expected_px[seen]).std()) / max(squares, 1e-12) ** 0.5
    if share + error > UNTRUE:  # errors of neighbouring steps are not independent
        return tracks, ()
    frames, after = np.arange(len(time_s)), np.flatnonzero(steps_s > CLOCK_SET * step_s) + 1
    columns = np.column_stack(
        [frames, np.ones_like(frames), frames[:, None] >= after]
    )  # a clock that is set starts anew
    step_s = float(np.linalg.lstsq(columns, time_s - time_s[0], rcond=None)[0][0])
    even_s = float(np.median(time_s - step_s * frames)) + step_s * frames
    message = (
        f"the time stamps are uneven, by {1000 * np.abs(steps_s - step_s).max():.0f} ms in one step, but the frames "
        f"are not: markers go no further in longer steps. The frames count as even ones, {1 / step_s:.4g} a second"
    )
    even = as_tracks(markers_of(tracks), even_s, position_px, tracks.confidence.values, tracks.source)
    return even, (Flag("uneven_stamps", message=message),)


def _over(values: np.ndarray, steps: int) -> np.ndarray:
    """Return how much values (n, …) change over so many steps."""
    return np.asarray(values[steps:] - values[:-steps])


def _rounding(time_s: np.ndarray) -> float:
    """Return the power of ten that all times are multiples of, s; 0 where they are finer than microseconds."""
    for digits in range(7):
        scaled = (time_s - np.floor(time_s[0])) * 10**digits
        if np.abs(scaled - np.rint(scaled)).max() < 1e-6 * 10 ** max(digits - 3, 0):
            return float(10.0**-digits)
    return 0.0


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
    above = ""
    while lines and (not lines[0][1].strip() or lines[0][1].lstrip().startswith(COMMENTS)):
        above = lines.pop(0)[1].strip().lstrip("#%/").strip()
    faults = FaultCollector(str(path))
    if not lines:
        faults.add("", "the file is empty", expected="comma-separated rows of numbers")
    faults.raise_if_any()
    separator = _separator(lines[len(lines) // 2][1])
    rows = [Row(number, _cells(line, separator)) for number, line in lines]
    while len(rows) > 1 and not any(rows[-1].cells):
        rows.pop()
    rows = _without_settings(rows)
    _check_thousands(rows, faults)
    table = as_table(str(path), rows, text.endswith(("\n", "\r")))
    names = _cells(above, separator)
    if table.header is None and above and len(names) == len(rows[0].cells) > 1:  # a header in a comment, as of NumPy
        table = as_table(str(path), [Row(lines[0][0] - 1, names), *rows], table.ends_whole)
    return _without_index(table)


def _without_settings(rows: list[Row]) -> list[Row]:
    """Return the rows from the header on, where it stands below lines of settings, which have fewer cells."""
    wide = len(rows[-1].cells)
    first = next(k for k, row in enumerate(rows) if len(row.cells) == wide)
    named = as_table("", rows[first:], ends_whole=True).header is not None
    settings = wide > 2 and all(len(row.cells) < wide / 2 for row in rows[:first])
    return rows[first:] if named and settings and first <= MOST_ABOVE else rows


def _check_thousands(rows: Sequence[Row], faults: FaultCollector) -> None:
    """Check that no number has its thousands kept apart: 1,024 would be read as 1.024.

    Raises:
        InputError: one has, with the faults before.
    """
    for column in range(len(rows[-1].cells)):
        cells = {row.line: row.cells[column] for row in rows if column < len(row.cells)}
        whole = max((int(cell) for cell in cells.values() if cell.isdecimal()), default=0)
        parted = [line for line, cell in cells.items() if "." in cell] if 100 <= whole < 1000 else []
        if parted and all(MAYBE_GROUPED.fullmatch(cells[line]) for line in parted):
            what, step = "the thousands of a number are kept apart", "Write 1024, not 1,024 nor 1.024."
            where, found = f"line {parted[0]}, column {column + 1}", cells[parted[0]]
            faults.add(where, what, found=found, expected="numbers with a decimal point", next_step=step)
            faults.raise_if_any()


def _separator(line: str) -> str | None:
    """Guess the separator of the cells from a line amid the table; None means blanks."""
    if ";" in line or "\t" in line:
        return ";" if ";" in line else "\t"
    return "," if "," in line or len(line.split()) < 2 else None


def _cells(line: str, separator: str | None) -> list[str]:
    quoted = separator is not None and '"' in line
    parts = next(csv.reader([line], delimiter=separator)) if quoted and separator else line.split(separator)
    cells = [cell.strip().strip('"').strip() for cell in parts]
    cells = [DECIMAL_COMMA.sub(r"\1.\2", cell) for cell in cells]
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


@dataclass(frozen=True, eq=False)
class ForeignTracks:
    """Tracks of n frames and k markers as a file of another program holds them, under its own names.

    Attributes:
        file: the name for messages.
        word: the program's word for a marker.
        names: names of the k markers, in the order of the file.
        position_px: (n, k, 2), nan where missing.
        confidence: (n, k), nan where the file does not tell.
        where: the place of each frame in the file.
        time_s: (n,) s; None where the file has no time.
        frame: (n,) number of each frame, which counts where there is no time.
    """

    file: str
    word: str
    names: tuple[str, ...]
    position_px: np.ndarray
    confidence: np.ndarray
    where: Sequence[str]
    time_s: np.ndarray | None = None
    frame: np.ndarray | None = None

    def renamed(self, rename: Mapping[str, str]) -> tuple[str, ...]:
        """Return the markers' names in our terms; `rename` maps theirs to ours.

        Raises:
            InputError: two of theirs would have one name.
        """
        names = tuple(rename.get(name, name) for name in self.names)
        if twice := [name for name in dict.fromkeys(names) if names.count(name) > 1]:
            theirs = [f"{own} and {other}" for own, other in (self._named(name, names) for name in twice)]
            what, expected = f"two {self.word}s have one name", "a name of its own for each"
            found = ", ".join(f"{both} as {name}" for both, name in zip(theirs, twice, strict=True))
            raise InputError([Fault(self.file, "", what, found, expected, next_step="Look into --rename.")])
        return names

    def _named(self, name: str, names: tuple[str, ...]) -> list[str]:
        return [own for own, other in zip(self.names, names, strict=True) if other == name][:2]

    def tracks(
        self, markers: Sequence[str], fps: float | None, faults: FaultCollector, rename: Mapping[str, str] = NO_NAMES
    ) -> xr.Dataset:
        """Return the tracks of m markers; other tracks of the file are dropped.

        A position with one half missing is missing altogether; a confidence that is missing is 1, 0 where the position
        is, and 1 where it is a little above that. Times rounded so coarsely that frames are uneven are made even.

        Args:
            markers: our names of the m markers.
            fps: frame rate; where the file has no time, frame k is at k / `fps`.
            faults: takes the faults.
            rename: from the file's names to ours.

        Raises:
            InputError: markers that are not there, no time and no `fps`, times that do not increase or are no seconds,
                places that are no pixels, confidences outside [0, 1], a marker that is missing throughout, less than
                two frames, and the faults that were there before.
        """
        names = self.renamed(rename)
        unused = [name for name in rename if name not in self.names]
        check_names(markers, names, self.word, faults, unused, set(rename.values()))
        if self.time_s is None and fps is None:
            faults.add("", "the file has no time", expected="the frame rate of the camera", next_step="Add `--fps 60`.")
        faults.raise_if_any()
        assert self.time_s is not None or (fps is not None and self.frame is not None)
        told = np.array(self.frame if self.time_s is None else self.time_s, dtype=float)
        time_s = told / (fps or np.nan) if self.time_s is None else told
        chosen = [names.index(marker) for marker in markers]
        position, confidence = np.array(self.position_px[:, chosen], dtype=float), self.confidence[:, chosen]
        missing = np.isnan(position).any(axis=2)  # (n, m)
        position[missing] = np.nan
        belief = np.where(np.isnan(confidence), 1.0, confidence)
        belief = np.where(missing, 0.0, np.where((belief > 1) & (belief <= SURELY_ABOVE), 1.0, belief))
        self._check(markers, time_s, position, belief, faults)
        if self.time_s is not None:
            time_s = even_times(time_s, fps, faults.file)
        return as_tracks(tuple(markers), time_s, position, belief)

    def _check(
        self, markers: Sequence[str], time_s: np.ndarray, place: np.ndarray, belief: np.ndarray, faults: FaultCollector
    ) -> None:
        """Check the samples of m markers: (n,) times, s, (n, m, 2) places, px, nan where missing, (n, m) confidences.

        Raises:
            InputError: every fault at once.
        """
        check_count(len(time_s), faults)
        check_seen(~np.isnan(place).any(axis=2), faults)
        check_percent(belief, faults)
        late = (1 + np.flatnonzero(~(np.diff(time_s) > 0))).tolist()
        outside = np.argwhere((belief < 0) | (belief > 1)).tolist()
        far = np.argwhere(np.abs(np.nan_to_num(place)).max(axis=2) > FARTHEST_PX).tolist()

        def fault(row: int, k: int | None, what: str, found: object, expected: str) -> Fault:
            where = self.where[row] if k is None else f"{self.where[row]}, {markers[k]}"
            return Fault(faults.file, where, what, f"{found}", expected)

        in_reach = f"pixels, no further than {FARTHEST_PX:g} from the corner"
        told, what, more = time_s, "time does not increase", ""
        if self.time_s is None and self.frame is not None:
            told, what, more = self.frame, "frames do not go on", ", each frame in one row"
        lost = [k for k in late if np.isnan(told[k])]
        faults.extend_capped([fault(k, None, "it is not told when", "an empty cell", "a later time") for k in lost])
        late = [k for k in late if not np.isnan(told[k - 1 : k + 1]).any()]
        faults.extend_capped([fault(k, None, what, f"{told[k]:.10g}", f"after {told[k - 1]:.10g}{more}") for k in late])
        faults.extend_capped([fault(k, i, "confidence out of range", belief[k, i], "0 to 1") for k, i in outside])
        faults.extend_capped([fault(k, i, "is beyond any image", place[k, i], in_reach) for k, i in far])
        if not faults:
            check_seconds(time_s, faults)
            check_pixels(place, faults)
            check_summary(place, self.where, faults)
            _check_side(place, faults)
        faults.raise_if_any()


def check_names(
    markers: Sequence[str],
    found: Sequence[str],
    word: str,
    faults: FaultCollector,
    unused: Sequence[str] = (),
    given: Collection[str] = (),
) -> None:
    """Add one fault for all markers that a file does not hold, and one for names to rename that it does not have.

    Args:
        markers: names that the file has to hold.
        found: names that it holds, after renaming.
        word: the file's word for a marker.
        faults: takes the faults.
        unused: names to rename that the file does not have.
        given: names that others were renamed to.
    """
    theirs = list(dict.fromkeys(found))
    if unused:
        what, step = "no such name in the file to rename", did_you_mean(unused[0], theirs)
        faults.add("--rename", what, found=", ".join(unused), choices=tuple(theirs), next_step=step)
    missing = [marker for marker in markers if marker not in theirs]
    if not missing:
        return
    free = [name for name in theirs if name not in markers]
    if len(missing) == 1 and (hint := did_you_mean(missing[0], free)):
        if did_you_mean(missing[0], given) == hint:
            hint = f"Is it a slip in --rename? Write {missing[0]!r} there."
        faults.add("", f"no {word} {missing[0]!r}", choices=tuple(theirs), next_step=hint)
        return
    alike = {_letters(name): name for name in free}
    same = [f"{alike[_letters(name)]}={name}" for name in missing if _letters(name) in alike]
    some = f"{free[0]}={missing[0]},…" if free else "theirs=ours,…"
    pairs = ",".join(same) if len(same) == len(missing) else some
    if not free and not same:
        step = f"If no others were tracked, take these alone: `calib convert FILE --markers {','.join(theirs)} …`."
        if needed := [name for name in missing if name in HEAD_MARKERS]:
            step = f"No trial goes without {' and '.join(needed)}: track these too."
        elif set(theirs) <= set(HEAD_MARKERS):
            step = "No trial goes without a marker on the tail, better two or more: track these too."
        what, expected = f"no {word} {', '.join(missing)}", ", ".join(markers)
        faults.add("", what, found=", ".join(theirs), expected=expected, next_step=step)
        return
    pairs = shlex.quote(pairs) if " " in pairs else pairs
    plural = f"{word[:-1]}ies" if word.endswith("y") else f"{word}s"
    faults.add(
        "",
        f"no {word if len(missing) == 1 else plural} {', '.join(missing)}"
        if len(missing) < len(markers)
        else f"other {plural}",
        found=", ".join(theirs),
        expected=", ".join(markers),
        next_step=f"Give the others their names, in order of the body: `--rename {pairs}`, or rename them in the file.",
    )


def _letters(name: str) -> str:
    """Return a name as small letters and digits alone."""
    return "".join(filter(str.isalnum, name.lower()))


def _check_side(position_px: np.ndarray, faults: FaultCollector) -> None:
    """Add a fault where most places (n, m, 2) are left of the picture or above it."""
    step = "Count x to the right and y downwards, in pixels from the top left corner of the picture."
    for axis, name in enumerate("xy"):
        known = position_px[..., axis][np.isfinite(position_px[..., axis])]
        if np.median(known) < 0:
            what, found = f"{name} is negative, where no picture is", f"{np.median(known):.4g} px in the median"
            faults.add("", what, found=found, expected="places in the picture", next_step=step)


def save_fishsim(path: Path, tracks: xr.Dataset) -> None:
    """Write tracks in the authors' form, nan where missing, whole or not at all; `swimcal.tracks.load_tracks` reads it.

    Times and confidences are lost.

    Raises:
        ResultsNotWritable: the file cannot be written.
    """
    rows = pixels_of(tracks).reshape(len(tracks.time.values), -1).tolist()  # (n, 2 m)
    write_whole(path, "".join(",".join(map(repr, row)) + "\n" for row in rows))
