"""Tracks: where each marker is in each frame, in pixels of the image, as one labelled `xarray.Dataset`.

Its dimensions are ``time``, ``space`` (x to the right and y down, the centre of the top left pixel at (0, 0)) and
``keypoint``, as in the package `movement`:

- ``position`` (time, space, keypoint), px, nan where missing;
- ``confidence`` (time, keypoint) in [0, 1], 0 where the position is missing;
- ``time``, s, strictly increasing; ``keypoint``, the names of the markers.

Attributes: ``fps``, frames a second; ``time_unit``, "seconds"; ``source``, the file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from swimcal.errors import Fault, FaultCollector, did_you_mean, shown
from swimcal.results import write_whole
from swimcal.tables import EMPTY, FILL, RawTable, check_time, read_table, to_numbers

if TYPE_CHECKING:
    import xarray as xr

TIME = "time_s"
FARTHEST_PX = 1e6
SUFFIXES = ("_x", "_y", "_confidence")
UNSEEN = "no marker is seen in any frame"
"""The fault of tracks without any sample."""
SLOWEST_STEP_S = 0.5
"""Longest time between two frames of a camera; longer steps are not in seconds."""
FASTEST_STEP_S = 1 / 2000
"""Shortest time between two frames of a camera; shorter steps are not in seconds."""
SMALLEST_BODY_PX = 3.0
"""Smallest length of a robot in the picture; the places of a smaller one are in metres."""
SURELY_ABOVE = 1.5
"""Confidences of networks go a little beyond 1; those beyond this are percent, or no confidences."""
MOST_SUMMARIES = 8
"""Rows of statistics that may end a table."""
MEAN_ROUNDED_PX = 0.51
"""A row of means differs by no more from them, as it may be rounded to whole pixels."""
LEAST_JUMP_PX = 3.0
"""It differs by more than this from the row before it, or a robot at rest would end in means."""
NO_NAMES: Mapping[str, str] = MappingProxyType({})


_PERCENT = 0.1  # least share of confidences above 1 that look like percent
_SAME_PX = 2.0  # most by which the same places differ in tracks of two programs, in the median of the markers
_LEAST_SHARED = 3  # least number of markers by which a frame is known again


def as_tracks(
    markers: Sequence[str], time_s: np.ndarray, position_px: np.ndarray, confidence: np.ndarray, source: str = ""
) -> xr.Dataset:
    """Build the tracks of n frames and m markers in the form of this module.

    Args:
        markers: names of the m markers.
        time_s: (n,) times of the frames, s, strictly increasing.
        position_px: (n, m, 2) positions in the image, px, nan where missing.
        confidence: (n, m) confidence in [0, 1], 0 where the position is missing.
        source: the file that the tracks come from.
    """
    import xarray as xr  # it takes half a second to load, which the help of a command need not wait for

    n, m = len(time_s), len(markers)
    if position_px.shape != (n, m, 2) or confidence.shape != (n, m):
        raise ValueError(
            f"position_px {position_px.shape} and confidence {confidence.shape} do not fit "
            f"{n} frames of {m} markers: expected {(n, m, 2)} and {(n, m)}"
        )
    steps_s = np.diff(time_s)  # single steps are rounded as they were written: the mean of those without gaps is better
    usual_s = np.median(steps_s) if n > 1 else np.nan
    regular = np.abs(steps_s - usual_s) < 0.75 * usual_s  # a step twice as long is a gap, half of one a coarse clock
    fps = round(1 / float(steps_s[regular].mean()), 3) if regular.any() else np.nan
    return xr.Dataset(
        {
            "position": (("time", "space", "keypoint"), np.swapaxes(position_px, 1, 2), {"units": "px"}),
            "confidence": (("time", "keypoint"), confidence),
        },
        {"time": ("time", time_s, {"units": "s"}), "space": ["x", "y"], "keypoint": list(markers)},
        {"fps": fps, "time_unit": "seconds", "source": source},
    )


def markers_of(tracks: xr.Dataset) -> tuple[str, ...]:
    """Return the names of the m markers."""
    return tuple(tracks.keypoint.values.tolist())


def by_marker(position: xr.DataArray) -> np.ndarray:
    """Return the positions as an (n, m, 2) view, for loops over numbers."""
    return position.transpose("time", "keypoint", "space").values


def pixels_of(tracks: xr.Dataset) -> np.ndarray:
    """Return the positions as an (n, m, 2) view, px."""
    return by_marker(tracks.position)


def shared_frames(first: xr.Dataset, second: xr.Dataset) -> int:
    """Count the frames that two recordings have in common, in the same order.

    A frame is the same if the markers that both see, three or more, are at the same places, as far as two programs
    agree.

    Args:
        first: tracks of a recording.
        second: tracks of another one, of the same markers in the same order.
    """
    longer, shorter = sorted((pixels_of(first), pixels_of(second)), key=len, reverse=True)
    probes = np.flatnonzero(np.isfinite(shorter).all(axis=2).sum(axis=1) >= _LEAST_SHARED)[
        :: max(len(shorter) // 16, 1)
    ]
    shifts = {int(place) - int(probe) for probe in probes for place in np.flatnonzero(_same(longer, shorter[probe]))}
    best = 0
    for shift in shifts:
        own, other = slice(max(-shift, 0), len(longer) - shift), slice(max(shift, 0), len(shorter) + shift)
        best = max(best, int(_same(longer[other], shorter[own]).sum()))
    return best


def _same(rows_px: np.ndarray, others_px: np.ndarray) -> np.ndarray:
    """Tell which rows (n, m, 2) of tracks are those of others, or of one other."""
    apart_px = np.linalg.norm(rows_px - others_px, axis=2)
    seen = np.isfinite(apart_px)
    near = (apart_px < _SAME_PX).sum(axis=1)
    return np.asarray((seen.sum(axis=1) >= _LEAST_SHARED) & (2 * near > seen.sum(axis=1)))


def load_tracks(
    path: Path,
    markers: Sequence[str],
    fps: float,
    *,
    minimum: int = 2,
    rename: Mapping[str, str] = NO_NAMES,
    seen: bool = True,
) -> xr.Dataset:
    """Read the tracks of one trial, in either format of the session folder.

    With a header ``time_s,<marker>_x,<marker>_y,<marker>_confidence,…`` the columns may come in any order, and a
    confidence may be left out (then it is 1). Without one the columns are x0,y0,x1,y1,… in the order of `markers`, and
    row k is at k / `fps`. An empty or ``nan`` cell is a missing sample; a position with one half missing is missing
    altogether. Packed files (.csv.gz) are unpacked.

    Args:
        path: the file.
        markers: names of the markers, all of which the file must hold.
        fps: frames a second of files without a header.
        minimum: number of frames that the file must hold.
        rename: names of the file's columns, and which markers they are.
        seen: whether tracks without any sample are a fault.

    Raises:
        InputError: every fault of the file at once.
    """
    table = read_table(path)
    faults = FaultCollector(table.file)
    columns = table.header or tuple(f"{marker}{suffix}" for marker in markers for suffix in ("_x", "_y"))
    columns = tuple(_rename(column, rename) for column in columns) if rename else columns
    _check_columns(table, columns, tuple(markers), faults)
    faults.raise_if_any()
    values = to_numbers(table, columns, faults)  # (n, columns)
    tracks = _assemble(values, columns, tuple(markers), fps, str(path))
    if not faults:
        check_time(table, tracks.time.values, faults)
        if TIME in columns:
            check_seconds(tracks.time.values, faults)
        check_pixels(pixels_of(tracks), faults)
        check_summary(pixels_of(tracks), [f"line {row.line}" for row in table.rows], faults)
        if seen:
            check_seen(~np.isnan(pixels_of(tracks)[..., 0]), faults)
        _check_samples(table, values, columns, tracks, faults)
    check_count(len(table.rows), faults, minimum)
    faults.raise_if_any()
    return tracks


def check_count(frames: int, faults: FaultCollector, minimum: int = 2) -> None:
    """Add a fault where there are too few frames; one of its own where there is none."""
    if not frames:
        faults.add("", EMPTY, found="no frame", expected=f"at least {minimum} frames", next_step=FILL)
    elif frames < minimum:
        faults.add("", "too short", found=f"{frames} frames", expected=f"at least {minimum}")


def check_seen(present: np.ndarray, faults: FaultCollector) -> None:
    """Add a fault where no marker has a sample in `present` (n, m).

    A single marker that is never seen takes no part in its trial.
    """
    if len(present) and not present.any():
        step = "Track the trial again, or take it out of session.toml."
        faults.add("", UNSEEN, expected="samples of nose, neck and tail", next_step=step)


def check_seconds(time_s: np.ndarray, faults: FaultCollector) -> None:
    """Add a fault where the times (n,) of frames cannot be seconds: milliseconds, minutes, numbers of frames."""
    steps = np.diff(time_s)
    usual = float(np.median(steps)) if len(steps) and np.isfinite(steps).all() else 0.0
    if usual <= 0 or FASTEST_STEP_S <= usual < SLOWEST_STEP_S:
        return
    units = {"milliseconds": 1e-3, "microseconds": 1e-6, "nanoseconds": 1e-9, "minutes": 60.0, "hours": 3600.0}
    likely = [unit for unit, s in units.items() if FASTEST_STEP_S <= usual * s <= 0.1]
    if np.all(np.abs(steps - np.rint(steps)) < 1e-9) and usual < 5:
        step = "They look like numbers of frames: name the column frame, and give the frame rate, `--fps 60`."
    elif likely:
        named = "name the column time_ms for `calib convert`, " if likely[0] == "milliseconds" else ""
        step = (
            f"They look like {likely[0]}: write them in seconds, {named}or give the frame rate instead of the column."
        )
    else:
        step = "Write them in seconds, or give the frame rate instead of the column."
    found = f"frames {usual:.4g} apart, {1 / usual:.3g} frames a second if these were seconds"
    faults.add("", "the times are not in seconds", found=found, expected="time_s in seconds", next_step=step)


def check_pixels(position_px: np.ndarray, faults: FaultCollector) -> None:
    """Add a fault where the body of the markers (n, m, 2) is too small for pixels: places in metres."""
    whole = position_px[np.isfinite(position_px).all(axis=(1, 2))] if position_px.shape[1] > 2 else np.zeros((0, 1, 2))
    if len(whole) == 0:
        return
    body = float(np.median(np.hypot(*np.ptp(whole, axis=1).T)))
    if body < SMALLEST_BODY_PX:
        step = "Are these metres? Give the places in pixels of the picture, as they were tracked."
        what, expected = "the places are not in pixels", "pixels of the picture, the robot tens of them long"
        faults.add("", what, found=f"a robot {body:.3g} px long", expected=expected, next_step=step)


def check_percent(confidence: np.ndarray, faults: FaultCollector) -> None:
    """Check that confidences are no percent, which one fault says of all of them.

    Raises:
        InputError: they look like percent, with the faults before.
    """
    known = confidence[np.isfinite(confidence)]
    above = float(np.mean(known > SURELY_ABOVE)) if known.size else 0.0
    if above > _PERCENT and known.min() >= 0 and 10 < known.max() <= 100:
        faults.add(
            "",
            "the confidences are not between 0 and 1",
            found=f"{known.max():g} at most, above 1 in {100 * above:.0f} % of the samples",
            expected="0 to 1",
            next_step="They look like percent: divide them by 100.",
        )
        faults.raise_if_any()


def check_summary(position_px: np.ndarray, where: Sequence[str], faults: FaultCollector) -> None:
    """Add a fault where one of the last rows (n, m, 2) holds the means of those before: it is no frame.

    Args:
        position_px: (n, m, 2) px, nan where missing.
        where: place of each row in the file, for messages.
        faults: receives what is wrong.
    """
    for row in range(max(2, len(position_px) - MOST_SUMMARIES), len(position_px)):
        last, before = position_px[row], position_px[:row]
        seen = np.isfinite(last) & np.isfinite(before).any(axis=0)  # (m, 2)
        if seen.sum() < 4:
            continue
        off_px = np.abs(last[seen] - np.nanmean(before[:, seen], axis=0)).max()
        jump_px = np.abs(np.nan_to_num(last[seen] - before[-1][seen])).max()
        if off_px <= MEAN_ROUNDED_PX and jump_px > LEAST_JUMP_PX:
            what, step = "the means of the rows before, not a frame", "Remove it, and the statistics below it."
            faults.add(where[row], what, expected="places of one frame", next_step=step)
            return


def save_tracks(path: Path, tracks: xr.Dataset) -> None:
    """Write tracks with a header, whole or not at all; `load_tracks` reads the same numbers back.

    Raises:
        ResultsNotWritable: the file cannot be written.
    """
    names = [TIME, *(f"{marker}{suffix}" for marker in markers_of(tracks) for suffix in SUFFIXES)]
    samples = np.concatenate([pixels_of(tracks), tracks.confidence.values[..., None]], axis=2)  # (n, m, 3)
    table = np.column_stack([tracks.time.values, samples.reshape(len(samples), -1)])  # (n, 1 + 3 m)
    rows = [",".join("" if cell != cell else repr(cell) for cell in row) for row in table.tolist()]
    write_whole(path, "\n".join([",".join(names), *rows, ""]))


def _rename(column: str, rename: Mapping[str, str]) -> str:
    """Return the name of a column with the marker's own name for that of the file."""
    for suffix in SUFFIXES:
        if column.endswith(suffix) and (marker := column.removesuffix(suffix)) in rename:
            return f"{rename[marker]}{suffix}"
    return column


def _check_columns(table: RawTable, columns: tuple[str, ...], markers: tuple[str, ...], faults: FaultCollector) -> None:
    if table.header is None:
        _check_width(table, markers, faults)
        return
    needed = [TIME, *(f"{marker}{axis}" for marker in markers for axis in ("_x", "_y"))]
    if set(columns).isdisjoint(needed):
        found, three = shown(",".join(columns)), ", ".join(needed[:3])
        expected = f"the columns {three} … of {', '.join(markers)}, or rows of numbers alone"
        faults.add("line 1", "not a header of tracks", found=found, expected=expected)
        return

    def fault(what: str, found: str, expected: str, next_step: str = "") -> Fault:
        return Fault(table.file, "line 1", what, found, expected, next_step=next_step)

    known = [*needed, *(f"{marker}_confidence" for marker in markers)]
    anything, step = f"{TIME}, or _x, _y or _confidence of a marker of the session", "Add its marker to [markers] names"
    strange = [name for name in dict.fromkeys(columns) if name not in known]
    unnamed = "Row numbers? Remove the column; `calib convert` does."
    free = [name for name in known if name not in columns]
    hints = [did_you_mean(n, free) or f"{step}, or remove the column." if n else unnamed for n in strange]
    unknown = [fault("unknown column", shown(n), anything, hint) for n, hint in zip(strange, hints, strict=True)]
    all_of_it, absent = f"{TIME}, and _x and _y of every marker", [name for name in needed if name not in columns]
    missing = [fault(f"column {name!r} is missing", "", all_of_it) for name in absent]
    count = {name: columns.count(name) for name in known if columns.count(name) > 1}
    repeated = [fault(f"column {name!r} is repeated", f"{n} of it", "one of each") for name, n in count.items()]
    for kind in (unknown, missing, repeated):
        faults.extend_capped(kind)


def _check_width(table: RawTable, markers: tuple[str, ...], faults: FaultCollector) -> None:
    """Add one fault when no row has the width that the markers require, instead of one a row."""
    widths = {len(row.cells) for row in table.rows}
    expected = 2 * len(markers)
    if len(widths) == 1 and widths != {expected}:
        found, step = f"{widths.pop()} in every row", "Make [markers] names match the file, or give the file a header."
        wanted = f"{expected}: x and y of the {len(markers)} markers {', '.join(markers)}"
        faults.add("", "wrong number of columns", found=found, expected=wanted, next_step=step)


def _assemble(
    values: np.ndarray, columns: tuple[str, ...], markers: tuple[str, ...], fps: float, source: str
) -> xr.Dataset:
    index = {name: number for number, name in enumerate(columns)}
    time_s = values[:, index[TIME]] if TIME in index else np.arange(len(values)) / fps
    halves = [index[f"{marker}{suffix}"] for marker in markers for suffix in ("_x", "_y")]
    position_px = values[:, halves].reshape(len(values), len(markers), 2)
    confidence = np.ones((len(values), len(markers)))
    for number, marker in enumerate(markers):
        if (column := index.get(f"{marker}_confidence")) is not None:
            confidence[:, number] = np.where(np.isnan(values[:, column]), 1.0, values[:, column])
    missing = np.isnan(position_px).any(axis=2)  # (n, m)
    position_px[missing] = np.nan
    confidence[missing] = 0.0
    return as_tracks(markers, time_s, position_px, confidence, source)


def _check_samples(
    table: RawTable, values: np.ndarray, columns: tuple[str, ...], tracks: xr.Dataset, faults: FaultCollector
) -> None:
    position_px, names = pixels_of(tracks), markers_of(tracks)
    in_reach = f"pixels, no further than {FARTHEST_PX:g} from the corner, or an empty cell for a missing sample"

    def beyond(row: int, k: int) -> Fault:
        what, found = f"marker {names[k]!r} is beyond any image", "({:g}, {:g})".format(*position_px[row, k])
        return Fault(table.file, f"line {table.rows[row].line}", what, found, in_reach)

    far = np.argwhere(np.abs(np.nan_to_num(position_px)).max(axis=2) > FARTHEST_PX).tolist()
    faults.extend_capped([beyond(row, k) for row, k in far])

    def outside(row: int, column: int) -> Fault:
        where = f"line {table.rows[row].line}, column {column + 1} ({columns[column]})"
        return Fault(table.file, where, "confidence out of range", str(values[row, column]), "a number from 0 to 1")

    beliefs = [column for column, name in enumerate(columns) if name.endswith(SUFFIXES[2])]
    check_percent(values[:, beliefs], faults)
    for column in beliefs:
        rows = np.flatnonzero((values[:, column] < 0) | (values[:, column] > 1)).tolist()
        faults.extend_capped([outside(row, column) for row in rows])
