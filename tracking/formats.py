"""Formats of other programs: DeepLabCut and movement; plain tables are in `tracking.plain_table`.

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
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

from swimcal.errors import Fault, FaultCollector, InputError, shown
from swimcal.results import program_version, write_whole, writing_whole
from swimcal.tables import RawTable, to_numbers
from swimcal.tracks import NO_NAMES, markers_of, pixels_of, save_tracks
from tracking.foreign import COARSE, ForeignTracks, read_foreign_table, refuse_space, save_fishsim
from tracking.other_programs import Engine, check_readable
from tracking.plain_table import check_frames, read_headerless, read_plain

# DeepLabCut.
SCORER = "swimcal"
COORDS = ("x", "y", "likelihood")
UNIQUE = "single"
"""The individual under which projects with several animals keep the body parts that are there once."""
LABELS = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")

# movement.
PIXELS = frozenset({"px", "pixel", "pixels", "1", "dimensionless", ""})
"""Units in which places are taken, lower case."""
INDIVIDUAL = "fish"
SINGULAR = {"keypoints": "keypoint", "individuals": "individual"}
"""The names of dimensions before version 0.17, and since."""
DIMENSIONS = ("time", "space", "keypoint", "individual")

SECONDS = {"milliseconds": 1e-3, "microseconds": 1e-6, "nanoseconds": 1e-9, "minutes": 60.0, "ms": 1e-3, "us": 1e-6}
"""Seconds in the units that netCDF gives to times that were durations in memory."""


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
    if "z" in head["coords"]:
        refuse_space(list(dict.fromkeys(head["bodyparts"])), faults)
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
    check_frames("the first column", values[:, 0], faults)
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
            name = row.cells[0].lower()
            head[name] = [cell.lower() for cell in row.cells[1:]] if name == "coords" else row.cells[1:]
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
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # other programs' HDF5 has dimensions without names
            with xr.open_dataset(path, engine=engine, decode_times=False) as data:
                data.load()
    except (OSError, ValueError, KeyError, TypeError, IndexError, EOFError) as error:
        fault = Fault(str(path), "", "the file cannot be read", str(error), "a whole netCDF file")
        raise InputError([fault]) from error
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
    if "confidence" in chosen and set(chosen["confidence"].dims) == {"time", "keypoint"}:
        confidence = chosen["confidence"].transpose("time", "keypoint").values.astype(float)
    time, names = data["time"].values, tuple(data["keypoint"].values.astype(str).tolist())
    if np.issubdtype(time.dtype, np.timedelta64):
        time = time / np.timedelta64(1, "s")
    time = time.astype(float) * SECONDS.get(data["time"].attrs.get("units", ""), 1.0)
    where = [f"time[{row}]" for row in range(len(time))]
    in_frames = data.attrs.get("time_unit", "seconds") == "frames"
    fps = _frame_rate(data.attrs.get("fps"))
    if in_frames and fps > 0:
        in_frames, time = False, time / fps
    times = {"frame": time} if in_frames else {"time_s": time}
    return ForeignTracks(file, "keypoint", names, position, confidence, where, **times)


def _frame_rate(given: object) -> float:
    """Return a dataset's frame rate; nan where what it gives is none."""
    try:
        return float(given or np.nan)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return np.nan


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
    elif not {"x", "y"} <= (axes := set(data["space"].values.astype(str).tolist())):
        faults.add("", "no x and y", found=shown(data["space"].values.tolist()), expected="x and y in space")
    elif "z" in axes:
        refuse_space(data["keypoint"].values.astype(str).tolist(), faults)
    unit = str(data["position"].attrs.get("space_unit", "px"))  # `units` outlasts a conversion by arithmetic
    if unit.lower() not in PIXELS:
        step = "Give the places as they were tracked, before they are scaled."
        faults.add("", "the places are not in pixels", found=f"the unit {unit}", expected="px", next_step=step)
    if data.sizes["individual"] != 1:
        named = "individual" in data.coords
        found = shown(data["individual"].values.tolist()) if named else str(data.sizes["individual"])
        step = "Choose one: ds.sel(individual=[name])."
        faults.add("", "not one individual", found=found, expected="one", next_step=step)
    if data.attrs.get("time_unit", "seconds") not in ("seconds", "frames"):
        faults.add("", "unknown time_unit", found=shown(data.attrs["time_unit"]), choices=("seconds", "frames"))


FORMATS: dict[str, Callable[[Path, xr.Dataset], None]] = {
    "swimcal": save_tracks,
    "deeplabcut": save_deeplabcut,
    "movement": save_movement,
    "fishsim": save_fishsim,
}
"""The forms that tracks can be written in, by name: the contract's CSV, DeepLabCut's CSV, netCDF as of the package
`movement`, the authors' CSV without a header."""


MOST_ROWS = 10
"""Rows for each frame, beyond which the times of a form without times have jumped."""
WITH_TIMES = frozenset({"swimcal", "movement"})
"""The forms that hold the times of the frames."""


def read_foreign(path: Path, markers: Sequence[str]) -> ForeignTracks:
    """Read all that a file tracks, in any of the forms in `FORMATS` or SLEAP's CSV, recognised by the content.

    Args:
        path: the file; text may be packed (.gz).
        markers: names for rows without names, in their order.

    Raises:
        InputError: every fault of the file at once; of another program's file, what it is and the way that works.
    """
    if (engine := check_readable(path)) is not None:
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
    ``fishsim``. The forms without times have a row for each frame that is left out, without samples.

    Args:
        tracked: the tracks.
        path: the file to write.
        form: a key of `FORMATS`.

    Raises:
        InputError: a form without times cannot hold them, as they are not those of an even clock.
        ResultsNotWritable: the file cannot be written.
    """
    FORMATS[form](path, tracked if form in WITH_TIMES else _every_frame(tracked, form))


def _every_frame(tracked: xr.Dataset, form: str) -> xr.Dataset:
    """Return tracks with a row for each frame of an even clock, without samples where there was none."""
    time_s = tracked.time.values
    if len(time_s) < 2:
        return tracked
    step_s = float(np.median(np.diff(time_s)))
    frame = np.rint((time_s - time_s[0]) / step_s)
    step_s = float((frame @ (time_s - time_s[0])) / (frame @ frame))
    off_s = np.abs(time_s - time_s[0] - frame * step_s).max()
    if off_s > COARSE * step_s or (np.diff(frame) < 1).any() or frame[-1] > MOST_ROWS * len(frame):
        lasts_s = time_s[-1] - time_s[0]
        found = f"{len(frame)} frames in {lasts_s:.4g} s, up to {off_s:.2g} s off frames every {step_s:.3g} s"
        what, choices = f"{form!r} holds no times, and these are not even", tuple(sorted(WITH_TIMES))
        raise InputError([Fault("--to", "", what, found, "an even clock", choices)])
    if frame[-1] + 1 == len(frame):
        return tracked
    filled = tracked.assign_coords(time=frame).reindex(time=np.arange(frame[-1] + 1))
    confidence = filled.confidence.fillna(0.0)
    return filled.assign(confidence=confidence).assign_coords(time=time_s[0] + step_s * filled.time.values)
