"""Formats of other programs: DeepLabCut, movement, plain CSV.

`import_tracks` recognises a file by its content, `export_tracks` writes the format that is named.

DeepLabCut's CSV has three or four header rows, then one row a frame; single-animal as written, both as read.

    scorer,swimcal,swimcal,swimcal,…
    individuals,fish,fish,fish,…            only in files of multi-animal projects
    bodyparts,nose,nose,nose,…
    coords,x,y,likelihood,…
    0,310.5,95.0,0.98,…

The first column is the number of the frame; there is no time in the file. Of several individuals one is read, with the
body parts of their own ("single"). Labels of single pictures, whose first column is a file, are no tracks.
https://deeplabcut.github.io/DeepLabCut/docs/standardDeepLabCut_UserGuide.html

The `movement` package's netCDF is its "poses" dataset: dimensions time, space, keypoint, individual; variables
``position`` (time, space, keypoint, individual) and ``confidence`` (time, keypoint, individual); attributes ds_type,
source_software, source_file, time_unit, fps. Before version 0.17 the last two dimensions were called keypoints and
individuals: both names are read. States and sizes of samples are further variables, which `movement` keeps.
https://movement.neuroinformatics.dev/user_guide/movement_dataset.html

Plain tables have a header of names: this program's, SLEAP's, and others with x and y of each marker.

    time_s,nose_x,nose_y,nose_confidence,…
    track,frame_idx,instance.score,nose.x,nose.y,nose.score,…           SLEAP, File > Export Analysis CSV

https://docs.sleap.ai/latest/learnings/export-analysis/
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
import xarray as xr

from swimcal.errors import FaultCollector, did_you_mean, shown
from swimcal.results import program_version, write_whole, writing_whole
from swimcal.tables import RawTable, Row, to_numbers
from swimcal.tracks import FASTEST_STEP_S, NO_NAMES, TIME, markers_of, pixels_of, save_tracks
from tracking.foreign import HDF5, NETCDF_3, ForeignTracks, check_readable, read_foreign_table, save_fishsim

# DeepLabCut.
SCORER = "swimcal"
COORDS = ("x", "y", "likelihood")
UNIQUE = "single"
"""The individual under which projects with several animals keep the body parts that are there once."""
LABELS = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")

# movement.
Engine = Literal["h5netcdf", "scipy"]
"""Engines of xarray: for netCDF 4, which is HDF5, and for netCDF 3."""
INDIVIDUAL = "fish"
SINGULAR = {"keypoints": "keypoint", "individuals": "individual"}
"""The names of dimensions before version 0.17, and since."""
DIMENSIONS = ("time", "space", "keypoint", "individual")

# Plain tables: columns by their names.
IN_SECONDS = frozenset({TIME, "time", "t", "time (s)", "time(s)", "time [s]", "t_s", "t (s)", "seconds", "timestamp"})
SECONDS = {"milliseconds": 1e-3, "microseconds": 1e-6, "nanoseconds": 1e-9, "minutes": 60.0, "ms": 1e-3, "us": 1e-6}
"""Seconds in the units that netCDF gives to times that were durations in memory."""
IN_MILLISECONDS = frozenset({"time_ms", "t_ms", "time (ms)", "time(ms)", "time [ms]", "t (ms)", "milliseconds"})
FRAMES = frozenset({"frame", "frames", "frame_idx", "frame_index", "frame_number", "frame_no", "frame_id", "fnum", ""})
"""Names of the columns that tell when, lower case; without one the rows are the frames."""
TRACK = "track"
"""SLEAP's column of the animal's name."""

ANIMAL_SCORE = "instance.score"
"""SLEAP's column of the animal's score."""
COORD_PLACES = {"x": 0, "y": 1, "confidence": 2, "likelihood": 2, "score": 2, "conf": 2, "prob": 2}
"""The place of a column among a marker's numbers, by the end of its name."""


def save_deeplabcut(path: Path, tracks: xr.Dataset) -> None:
    """Write tracks in DeepLabCut's form for one animal, whole or not at all; times are lost, frames stay.

    Raises:
        ResultsNotWritable: the file cannot be written.
    """
    levels = [[SCORER], markers_of(tracks), COORDS]
    columns = pd.MultiIndex.from_product(levels, names=["scorer", "bodyparts", "coords"])
    samples = np.concatenate([pixels_of(tracks), tracks.confidence.values[..., None]], axis=2)  # (n, m, 3)
    write_whole(path, pd.DataFrame(samples.reshape(len(samples), -1), columns=columns).to_csv())


def read_deeplabcut(table: RawTable) -> ForeignTracks:
    """Read every body part of DeepLabCut's CSV.

    Raises:
        InputError: every fault of the file at once.
    """
    faults = FaultCollector(table.file)
    head = _head(table, faults)
    columns = list(zip(head["bodyparts"], head["coords"], strict=True))  # without the first, the frame
    rows = replace(table, rows=table.rows[len(head) :])
    _check_tracks(rows, faults)
    parts = tuple(dict.fromkeys(part for part, _ in columns))
    if twice := [part for part in parts if columns.count((part, COORDS[0])) > 1]:
        step = "Rename or remove one of them in the file: nothing tells which is right."
        expected = "every body part once"
        faults.add("line 2", "body parts more than once", found=", ".join(twice), expected=expected, next_step=step)
    faults.raise_if_any()
    names = ("frame", *(f"{part} {coord}" for part, coord in columns))
    values = to_numbers(rows, names, faults)  # (n, 1 + columns)
    faults.raise_if_any()
    found = [_samples(values[:, 1:], columns, part, faults) for part in parts]
    faults.raise_if_any()
    samples = np.stack(found, axis=1)  # (n, k, 3)
    lines = [f"line {row.line}" for row in rows.rows]
    return ForeignTracks(table.file, "body part", parts, samples[..., :2], samples[..., 2], lines, frame=values[:, 0])


def is_deeplabcut(table: RawTable) -> bool:
    """Tell whether a table starts as DeepLabCut's files do."""
    return table.header is not None and table.header[0].lower() == "scorer"


def _check_tracks(rows: RawTable, faults: FaultCollector) -> None:
    """Check that the rows are frames of a video."""
    first = rows.rows[0].cells if rows.rows else []
    picture = next((cell for cell in first if cell.lower().endswith(LABELS)), None)
    if picture is not None:
        faults.add(
            "",
            "these are DeepLabCut's labels of single pictures, not tracks of a video",
            found=f"{len(rows.rows)} pictures, the first {Path(picture.replace(chr(92), '/')).name}",
            expected="a row for every frame",
            next_step="Give the CSV that `deeplabcut.analyze_videos(…, save_as_csv=True)` writes beside the video.",
        )


def _head(table: RawTable, faults: FaultCollector) -> dict[str, list[str]]:
    """Return the header rows after the first by their names, without their first cells."""
    head: dict[str, list[str]] = {}
    for row in table.rows[:3]:
        if row.cells[0].lower() in ("individuals", "bodyparts", "coords"):
            head[row.cells[0].lower()] = row.cells[1:]
    first = table.header or ("numbers",)
    if not is_deeplabcut(table) or not {"bodyparts", "coords"} <= head.keys():
        found = ", ".join([first[0], *(row.cells[0] for row in table.rows[:3])])
        expected = "rows that start with scorer, bodyparts and coords, with individuals before bodyparts if several"
        faults.add("line 1", "not the header of DeepLabCut", found=f"rows that start with {found}", expected=expected)
    elif len({len(row) for row in (first[1:], *head.values())}) > 1:
        found = ", ".join(f"{key}: {len(row)}" for key, row in head.items())
        faults.add("line 1", "header rows of different length", found=found, expected="as many cells in each")
    elif len(animals := [name for name in dict.fromkeys(head.get("individuals", ())) if name != UNIQUE]) > 1:
        step = "Write a file with the columns of one of them."
        faults.add("line 2", "more than one animal", found=", ".join(animals), expected="one", next_step=step)
    faults.raise_if_any()
    return head


def _samples(values: np.ndarray, columns: list[tuple[str, str]], marker: str, faults: FaultCollector) -> np.ndarray:
    """Return x, y and likelihood of one body part (n, 3); nan for a likelihood that the file does not hold."""
    samples = np.full((len(values), 3), np.nan)
    for number, coord in enumerate(COORDS):
        if (marker, coord) in columns:
            samples[:, number] = values[:, columns.index((marker, coord))]
        elif coord != "likelihood":
            faults.add("", f"body part {marker!r} has no {coord}", expected="x and y, and likelihood if there is one")
    return samples


def to_movement(tracked: xr.Dataset) -> xr.Dataset:
    """Turn tracks and their states into a poses dataset of `movement`, time in seconds."""
    data = tracked[["position", "confidence", "state", "size"]].expand_dims(individual=[INDIVIDUAL], axis=-1)
    data = data.assign_coords(time=tracked.time.values)  # without units, which readers take for a kind of date
    data.attrs = {
        "ds_type": "poses",
        "source_software": program_version(),
        "source_file": tracked.source,
        "time_unit": "seconds",
        "fps": tracked.fps,
    }
    return data


def save_movement(path: Path, tracked: xr.Dataset) -> None:
    """Write `to_movement` as netCDF, whole or not at all.

    Raises:
        ResultsNotWritable: the file cannot be written.
    """
    data = to_movement(tracked)
    with writing_whole(path) as part:
        data.to_netcdf(part, engine="h5netcdf")


def read_movement(path: Path, engine: Engine) -> ForeignTracks:
    """Read all keypoints of a poses dataset of `movement` with one individual.

    Args:
        path: the file.
        engine: xarray's engine for it.

    Raises:
        InputError: every fault of the file at once.
    """
    import xarray as xr

    faults = FaultCollector(str(path))
    try:
        with xr.open_dataset(path, engine=engine, decode_times=False) as data:
            data.load()
    except (OSError, ValueError, KeyError, TypeError, IndexError, EOFError) as error:
        faults.add("", "the file cannot be read", found=str(error), expected="a whole netCDF file")
    faults.raise_if_any()
    return from_movement(data, str(path))


def from_movement(data: xr.Dataset, file: str) -> ForeignTracks:
    """Take in a poses dataset of `movement` from memory, its dimensions in any order and either spelling.

    Args:
        data: the dataset.
        file: its name in messages.

    Raises:
        InputError: every fault of it at once.
    """
    faults = FaultCollector(file)
    data = data.rename({old: new for old, new in SINGULAR.items() if old in data.dims})
    if "position" in data and set(data["position"].dims) == set(DIMENSIONS[:3]):  # an individual is chosen already
        data = data.drop_vars("individual", errors="ignore").expand_dims("individual")
    _check_layout(data, faults)
    faults.raise_if_any()
    chosen = data.isel(individual=0).sel(space=["x", "y"])
    position = chosen["position"].transpose("time", "keypoint", "space").values.astype(float)  # (n, k, 2)
    confidence = np.full(position.shape[:2], np.nan)
    if "confidence" in chosen:
        confidence = chosen["confidence"].transpose("time", "keypoint").values.astype(float)
    time, names = data["time"].values, tuple(data["keypoint"].values.astype(str).tolist())
    if np.issubdtype(time.dtype, np.timedelta64):
        time = time / np.timedelta64(1, "s")
    time = time.astype(float) * SECONDS.get(data["time"].attrs.get("units", ""), 1.0)
    where = [f"time[{row}]" for row in range(len(time))]
    in_frames = data.attrs.get("time_unit", "seconds") == "frames"
    fps = float(data.attrs.get("fps") or np.nan)
    if in_frames and fps > 0:
        in_frames, time = False, time / fps
    times = {"frame": time} if in_frames else {"time_s": time}
    return ForeignTracks(file, "keypoint", names, position, confidence, where, **times)


def _check_layout(data: xr.Dataset, faults: FaultCollector) -> None:
    next_step = "Write it with `movement` as a poses dataset: ds.to_netcdf(path)."
    kind = data.attrs.get("ds_type", "poses")
    if kind != "poses" or "position" not in data or set(data["position"].dims) != set(DIMENSIONS):
        found = f"a dataset of {kind} with " + ", ".join(f"{name} {tuple(data[name].dims)}" for name in data.data_vars)
        expected = f"poses: position {DIMENSIONS}, confidence"
        faults.add(
            "", "not a poses dataset of movement", found=shown(found, 200), expected=expected, next_step=next_step
        )
        return
    if unlabelled := [name for name in DIMENSIONS[:3] if name not in data.coords]:
        faults.add("", "dimensions without labels", found=", ".join(unlabelled), expected="a coordinate for each")
    elif not {"x", "y"} <= set(data["space"].values.astype(str).tolist()):
        faults.add("", "no x and y", found=shown(data["space"].values.tolist()), expected="x and y in space")
    if data.sizes["individual"] != 1:
        named = "individual" in data.coords
        found = shown(data["individual"].values.tolist()) if named else str(data.sizes["individual"])
        step = "Choose one: ds.sel(individual=[name])."
        faults.add("", "not one individual", found=found, expected="one", next_step=step)
    if data.attrs.get("time_unit", "seconds") not in ("seconds", "frames"):
        faults.add("", "unknown time_unit", found=shown(data.attrs["time_unit"]), choices=("seconds", "frames"))


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
    if TRACK in header:  # the name of SLEAP's track is no number
        k = header.index(TRACK)
        table = replace(table, rows=[Row(row.line, [*row.cells[:k], "", *row.cells[k + 1 :]]) for row in table.rows])
    values = to_numbers(table, tuple(header), faults)  # (n, columns)
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
            _check_milliseconds(header[when], values[:, when], faults)
    else:
        _check_unused(header, values, {column for columns in markers.values() for column in columns.values()}, faults)
    return ForeignTracks(table.file, "marker", tuple(markers), samples[..., :2], samples[..., 2], lines, time_s, frame)


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
        match = re.fullmatch(r"(.+?)[_. ]([A-Za-z]+)", name)
        if match is None or match[2].lower() not in COORD_PLACES or name.lower() == ANIMAL_SCORE:
            continue
        columns, place = found.setdefault(match[1], {}), COORD_PLACES[match[2].lower()]
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


FORMATS: dict[str, Callable[[Path, xr.Dataset], None]] = {
    "swimcal": save_tracks,
    "deeplabcut": save_deeplabcut,
    "movement": save_movement,
    "fishsim": save_fishsim,
}
"""The forms that tracks can be written in, by name: the contract's CSV, DeepLabCut's CSV, netCDF as of the package
`movement`, the authors' CSV without a header."""


def read_foreign(path: Path, markers: Sequence[str]) -> ForeignTracks:
    """Read all that a file tracks, in any of the forms in `FORMATS` or SLEAP's CSV, recognised by the content.

    Args:
        path: the file; text may be packed (.gz).
        markers: names for rows without names, in their order.

    Raises:
        InputError: every fault of the file at once; of another program's file, what it is and the way that works.
    """
    check_readable(path)
    if (engine := _netcdf(path)) is not None:
        return read_movement(path, engine)
    table = read_foreign_table(path)
    if is_deeplabcut(table):
        return read_deeplabcut(table)
    return read_headerless(table, tuple(markers)) if table.header is None else read_plain(table)


def import_tracks(
    path: Path, markers: Sequence[str], fps: float | None = None, rename: Mapping[str, str] = NO_NAMES
) -> xr.Dataset:
    """Read the tracks of the named markers with `read_foreign`; other tracks of the file are dropped.

    Args:
        path: the file.
        markers: our names of the markers.
        fps: frame rate, for forms without time.
        rename: from the file's names to ours.

    Raises:
        InputError: every fault of the file at once.
    """
    found = read_foreign(path, markers)
    return found.tracks(markers, fps, FaultCollector(str(path)), rename).assign_attrs(source=str(path))


def export_tracks(tracked: xr.Dataset, path: Path, form: str) -> None:
    """Write tracks in a form of `FORMATS`, whole or not at all.

    States and sizes are kept by ``movement`` alone, times by ``swimcal`` and ``movement``, confidences by all but
    ``fishsim``.

    Args:
        tracked: the tracks.
        path: the file to write.
        form: a key of `FORMATS`.

    Raises:
        ResultsNotWritable: the file cannot be written.
    """
    FORMATS[form](path, tracked)


def _netcdf(path: Path) -> Engine | None:
    """Choose the engine that reads a file of netCDF; None for other files and unreadable ones."""
    try:
        with path.open("rb") as stream:
            head = stream.read(8)
    except OSError:
        return None
    return "h5netcdf" if head.startswith(HDF5) else "scipy" if head.startswith(NETCDF_3) else None
