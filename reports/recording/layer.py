"""A layer: one entity of a recording, with its look and its rows."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import rerun as rr

from reports.recording.palette import marker_colour

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


def lines(entity: str, names: Sequence[str], values: np.ndarray) -> Layer:
    """A line for each of k names over n frames, of (n, k) values."""
    n, k = values.shape
    style = rr.SeriesLines(names=list(names), colors=[marker_colour(i) for i in range(k)])
    columns = rr.Scalars.columns(scalars=values.ravel()).partition([k] * n)
    return Layer(entity, (style,), np.arange(n), tuple(columns))


def entity_of(*parts: str) -> str:
    """The path of an entity, from names that may hold any character."""
    return rr.new_entity_path(list(parts))
