"""DeepLabCut's CSV: three or four header rows, then one row a frame; single-animal as written, both as read.

    scorer,swimcal,swimcal,swimcal,…
    individuals,fish,fish,fish,…            only in files of multi-animal projects
    bodyparts,nose,nose,nose,…
    coords,x,y,likelihood,…
    0,310.5,95.0,0.98,…

The first column is the number of the frame; there is no time in the file. Of several individuals one is read, with the
body parts of their own ("single"). Labels of single pictures, whose first column is a file, are no tracks. https://deeplabcut.github.io/DeepLabCut/docs/standardDeepLabCut_UserGuide.html
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

from session import FaultCollector
from session.results import write_whole
from session.tables import RawTable, to_numbers
from session.tracks import markers_of, pixels_of
from tracking.records.foreign import ForeignTracks

SCORER = "swimcal"
COORDS = ("x", "y", "likelihood")
UNIQUE = "single"
"""The individual under which projects with several animals keep the body parts that are there once."""
LABELS = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")


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
    faults.raise_if_any()
    names = ("frame", *(f"{part} {coord}" for part, coord in columns))
    values = to_numbers(rows, names, faults)  # (n, 1 + columns)
    faults.raise_if_any()
    found = [_samples(values[:, 1:], columns, part, faults) for part in parts]
    faults.raise_if_any()
    samples = np.stack(found, axis=1)  # (n, k, 3)
    lines = [f"line {row.line}" for row in rows.rows]
    return ForeignTracks(table.file, "body part", parts, samples[..., :2], samples[..., 2], lines, frame=values[:, 0])


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


def is_deeplabcut(table: RawTable) -> bool:
    """Tell whether a table starts as DeepLabCut's files do."""
    return table.header is not None and table.header[0].lower() == "scorer"


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
