"""What a recording on disk holds."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rerun.chunk import RrdReader

from reports.recorded_trial import FRAME, TIME


class EntityContents(NamedTuple):
    """Rows that hold something, by the name of their component such as ``Points2D:positions``: their number, and the
    rows as Arrow arrays of which one follows the other; numbers (r,) and times (r,) of the frames, s.
    """

    rows: Mapping[str, int]
    columns: Mapping[str, Sequence[Any]]
    frame: np.ndarray
    time_s: np.ndarray


class RecordingContents(NamedTuple):
    """Entities by path, and how many blueprints it brings along."""

    entities: Mapping[str, EntityContents]
    blueprints: int


def read_recording(path: Path) -> RecordingContents:
    reader = RrdReader(path)
    batches: dict[str, list[Any]] = {}
    for chunk in reader.stream():
        batches.setdefault(chunk.entity_path, []).append(chunk.to_record_batch())
    return RecordingContents({path: _contents(parts) for path, parts in batches.items()}, len(reader.blueprints()))


def rows_of(contents: EntityContents, component: str) -> list[Any]:
    """Every row that holds something, one a frame, as Python values."""
    return [row for part in contents.columns[component] for row in part.to_pylist() if row is not None]


def _contents(batches: Sequence[Any]) -> EntityContents:
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
