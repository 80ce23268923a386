"""A layer: one entity of a recording, with its look and its rows."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import rerun as rr

FRAME, TIME = "frame", "time"
"""The timelines: the number of the frame from 0, and the time in the trial's own video."""


class Layer(NamedTuple):
    """One entity of a recording.

    Attributes:
        entity: its path.
        static: what holds at all times (Rerun archetypes).
        rows: (r,) numbers of the frames at which something stands.
        columns: Rerun columns of r rows each; empty where everything is static.
    """

    entity: str
    static: tuple[Any, ...] = ()
    rows: np.ndarray = np.zeros(0, dtype=np.int64)
    columns: tuple[Any, ...] = ()

    def send(self, stream: rr.RecordingStream, time_s: np.ndarray) -> None:
        """Sends it; `time_s` is the (n,) time of each frame."""
        if self.static:
            stream.log(self.entity, *self.static, static=True, strict=True)
        if self.columns:
            index = [rr.TimeColumn(FRAME, sequence=self.rows), rr.TimeColumn(TIME, duration=time_s[self.rows])]
            stream.send_columns(self.entity, index, self.columns, strict=True)

    def row_counts(self) -> dict[str, int]:
        """How many rows each component has, by the component's name as the file holds it."""
        static = (batch.component_descriptor() for part in self.static for batch in part.as_component_batches())
        counts = {str(descriptor): 1 for descriptor in static}
        return counts | {str(column.component_descriptor()): len(self.rows) for column in self.columns}


def entity_of(*parts: str) -> str:
    """The path of an entity, from names that may hold any character."""
    return rr.new_entity_path(list(parts))
