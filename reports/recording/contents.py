"""What a recording on disk holds, read back without a viewer."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rerun.chunk import RrdReader
from rerun.error_utils import RerunWarning

from reports.recording.layer import FRAME, TIME
from session import FaultCollector

PROPERTIES = "/__properties"
AGAIN = "Make it again with `calib view`."


class EntityContents(NamedTuple):
    """What stands at one entity.

    Attributes:
        rows: rows of each component that hold something, by the component's name such as ``Points2D:positions``.
        columns: the same rows themselves, as Arrow arrays of which one follows the other.
        frame: (r,) frame numbers of the rows that are not static.
        time_s: (r,) their times, s.
    """

    rows: Mapping[str, int]
    columns: Mapping[str, Sequence[Any]]
    frame: np.ndarray
    time_s: np.ndarray


class RecordingContents(NamedTuple):
    """What a recording holds.

    Attributes:
        entities: by path.
        blueprints: how many it brings along.
    """

    entities: Mapping[str, EntityContents]
    blueprints: int


def read_recording(path: Path) -> RecordingContents:
    """Reads a recording whole.

    Raises:
        InputError: it is not there, not a recording, empty or cut short.
    """
    faults = FaultCollector(str(path))
    batches: dict[str, list[Any]] = {}
    blueprints = 0
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RerunWarning)  # it only warns of a file that breaks off
            reader = RrdReader(path)
            blueprints = len(reader.blueprints())
            for chunk in reader.stream():
                batches.setdefault(chunk.entity_path, []).append(chunk.to_record_batch())
    except (OSError, ValueError, RuntimeError, RerunWarning) as error:
        faults.add("", "cannot be read", found=str(error), expected="a recording of Rerun", next_step=AGAIN)
    faults.raise_if_any()
    batches.pop(PROPERTIES, None)
    return RecordingContents({entity: _contents(parts) for entity, parts in batches.items()}, blueprints)


def check_rows(path: Path, expected: Mapping[str, Mapping[str, int]]) -> None:
    """Checks that a recording holds, at each entity, so many rows of each component, on both timelines, and a layout.

    Raises:
        InputError: everything that is missing, at once.
    """
    contents = read_recording(path)
    faults = FaultCollector(str(path))
    if not contents.blueprints:
        faults.add("", "no layout", found="no blueprint", expected="one", next_step=AGAIN)
    for entity, rows in expected.items():
        held = contents.entities[entity].rows if entity in contents.entities else {}
        short = [component for component, count in rows.items() if held.get(component, 0) != count]
        if short:
            found = ", ".join(f"{held.get(component, 0)} rows of {component}" for component in short)
            wanted = ", ".join(str(rows[component]) for component in short)
            faults.add(entity, "not whole", found=found, expected=wanted, next_step=AGAIN)
    faults.raise_if_any()


def _contents(batches: Sequence[Any]) -> EntityContents:
    """What the Arrow record batches of one entity hold."""
    columns: dict[str, list[Any]] = {}
    for batch in batches:
        for name, column in zip(batch.schema.names, batch.columns, strict=True):
            columns.setdefault(name, []).append(column)
    frame, time = (_whole_numbers(columns.get(name, ())) for name in (FRAME, TIME))
    held = {name: parts for name, parts in columns.items() if ":" in name}
    rows = {name: sum(len(part) - part.null_count for part in parts) for name, parts in held.items()}
    return EntityContents(rows, held, frame, 1e-9 * time)


def _whole_numbers(parts: Sequence[Any]) -> np.ndarray:
    """Arrow arrays of integers or durations as one int64 array, durations in ns."""
    return np.concatenate([np.zeros(0, np.int64), *(part.cast("int64").to_numpy() for part in parts)])
