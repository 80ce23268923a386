"""A tracked trial on disk: the contract's tracks, with states, sizes and flags."""

from __future__ import annotations

import json
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr

from session import FaultCollector, Flag, InputError
from session.errors import Fault, shown
from session.results import writing_whole
from session.tables import RawTable, read_table, read_text
from session.tracks import load_tracks, markers_of, pixels_of, save_tracks
from tracking.records.tracked import STATE_WORDS, SampleState, with_states

AGAIN = "Make it again with `calib track`."


class TrackedFiles(NamedTuple):
    """The three files of a tracked trial.

    Attributes:
        tracks: ``<trial>.csv``, the tracks of the public contract.
        states: ``<trial>.states.csv``, header ``time_s,<marker>_state,<marker>_size_px,…``.
        flags: ``<trial>.flags.json``, a list of flags in the form of the public contract.
    """

    tracks: Path
    states: Path
    flags: Path

    @classmethod
    def of(cls, folder: Path, trial: str) -> TrackedFiles:
        """Return the files of a trial in a folder."""
        return cls(*(folder / f"{trial}{suffix}" for suffix in (".csv", ".states.csv", ".flags.json")))


def save_tracked(folder: Path, trial: str, tracked: xr.Dataset) -> TrackedFiles:
    """Write the three files of a tracked trial; none of them appears before all are written.

    The tracks come last: where they are, so are the others.

    Args:
        folder: the folder of the files.
        trial: name of the trial.
        tracked: the tracks with states, sizes and flags.

    Raises:
        ResultsNotWritable: a file cannot be written; what stood there is unchanged.
    """
    files = TrackedFiles.of(folder, trial)
    flags = [flag.to_json() for flag in tracked.flags]
    with (
        writing_whole(files.tracks) as tracks,
        writing_whole(files.states) as states,
        writing_whole(files.flags) as part,
    ):
        save_tracks(tracks, tracked)
        states.write_text(_states_csv(tracked), encoding="utf-8", newline="\n")
        part.write_text(json.dumps(flags, indent=1, ensure_ascii=False) + "\n", encoding="utf-8", newline="\n")
    return files


def load_tracked(folder: Path, trial: str) -> xr.Dataset:
    """Read a trial that `save_tracked` wrote, every number as it was.

    Args:
        folder: the folder of the files.
        trial: name of the trial.

    Raises:
        InputError: every fault of the three files at once.
    """
    files = TrackedFiles.of(folder, trial)
    faults = FaultCollector()
    tracks, state, size_px = None, np.zeros(0), np.zeros(0)
    flags: tuple[Flag, ...] = ()
    with faults.nested():
        tracks = load_tracks(files.tracks, _markers(read_table(files.tracks)), fps=1.0, minimum=1)
    with faults.nested():
        flags = _load_flags(files.flags)
    if tracks is not None:
        with faults.nested():
            state, size_px = _load_states(files.states, tracks)
    faults.raise_if_any()
    assert tracks is not None
    return with_states(tracks, state, size_px, flags)


def _markers(table: RawTable) -> tuple[str, ...]:
    markers = tuple(name.removesuffix("_x") for name in table.header or () if name.endswith("_x"))
    if not markers:
        first = ",".join(table.header or table.rows[0].cells)
        expected = "a header time_s,<marker>_x,<marker>_y,<marker>_confidence,…"
        raise InputError([Fault(table.file, "line 1", "no header of tracks", shown(first), expected, (), AGAIN)])
    return markers


def _states_csv(tracked: xr.Dataset) -> str:
    words = np.array([state.word for state in SampleState])[tracked.state.values]  # (n, m)
    columns = [tracked.time.values]
    for word, size_px in zip(words.T, tracked["size"].values.T, strict=True):
        columns += [word, size_px]
    return pd.DataFrame(dict(zip(_names(markers_of(tracked)), columns, strict=True))).to_csv(index=False)


def _names(markers: tuple[str, ...]) -> tuple[str, ...]:
    return ("time_s", *(f"{marker}{suffix}" for marker in markers for suffix in ("_state", "_size_px")))


def _load_states(path: Path, tracks: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Read the states and sizes, both (n, m), and check that they fit the tracks."""
    table = read_table(path)
    absent = np.isnan(pixels_of(tracks)[..., 0])  # (n, m)
    try:
        cells = np.array([row.cells for row in table.rows])  # (n, 1 + 2 m)
        time_s, words, sizes = cells[:, 0].astype(float), cells[:, 1::2], cells[:, 2::2]
        state = np.array([[STATE_WORDS[word] for word in row] for row in words.tolist()], np.int8)
        size_px = np.where(sizes == "", "nan", sizes).astype(float)
        fit = table.header == _names(markers_of(tracks)) and np.array_equal(time_s, tracks.time.values)
        fit = fit and np.array_equal(state == SampleState.MISSING, absent)
    except (ValueError, KeyError, IndexError):
        fit = False
    if not fit:
        expected = f"a row for each of {len(absent)} frames, missing where there is no position"
        found = f"{len(table.rows)} rows of {shown(table.header)}"
        raise InputError([Fault(table.file, "", "not the states of the tracks next to it", found, expected, (), AGAIN)])
    return state, size_px


def _load_flags(path: Path) -> tuple[Flag, ...]:
    try:
        return tuple(Flag.from_json(flag) for flag in json.loads(read_text(path)))
    except (ValueError, KeyError, TypeError, AttributeError, IndexError, RecursionError) as error:
        found, expected = f"{type(error).__name__}: {error}", '[{"kind": "…", …}, …]'
        raise InputError([Fault(str(path), "", "not a list of flags", found, expected, (), AGAIN)]) from error
