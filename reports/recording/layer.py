"""A layer: one entity of a recording, with its look, its rows, and its colours on the viewer's dark ground."""

from collections.abc import Sequence
from colorsys import hsv_to_rgb
from typing import Any, NamedTuple

import numpy as np
import rerun as rr

from reports.colours import INKS
from tracking.records import SampleState

FRAME = "frame"
"""The timeline of the number of the frame, from 0."""
TIME = "time"
"""The timeline of the time in the trial's own video."""


Rgb = tuple[int, int, int]

GOLDEN_RATIO = 0.618034


def rgb(hexadecimal: str) -> Rgb:
    """Convert the colour ``#rrggbb`` to three numbers from 0 to 255."""
    red, green, blue = bytes.fromhex(hexadecimal.removeprefix("#"))
    return red, green, blue


TWIN = rgb(INKS["twin"].dark)
WARN = rgb(INKS["warn"].dark)
GAP = rgb(INKS["gap"].dark)

STATE_COLOURS: dict[SampleState, Rgb] = {
    SampleState.MISSING: rgb(INKS["flag-segment"].dark),
    SampleState.MEASURED: rgb(INKS["flag-other"].dark),
    SampleState.PREDICTED: rgb(INKS["ebt"].dark),
    SampleState.INTERPOLATED: rgb(INKS["flag-merged"].dark),
    SampleState.BY_HAND: rgb(INKS["ink"].dark),
}
"""A colour for each state of a sample."""


class Layer(NamedTuple):
    """One entity of a recording.

    Attributes:
        entity: path of the entity.
        static: Rerun archetypes that hold at all times.
        rows: (r,) numbers of the frames at which there is something.
        columns: Rerun columns of r rows each; empty where everything is static.
    """

    entity: str
    static: tuple[Any, ...] = ()
    rows: np.ndarray = np.zeros(0, dtype=np.int64)
    columns: tuple[Any, ...] = ()

    def send(self, stream: rr.RecordingStream, time_s: np.ndarray) -> None:
        """Send the layer to a recording; `time_s` is the (n,) time of each frame."""
        if self.static:
            stream.log(self.entity, *self.static, static=True, strict=True)
        if self.columns:
            index = [rr.TimeColumn(FRAME, sequence=self.rows), rr.TimeColumn(TIME, duration=time_s[self.rows])]
            stream.send_columns(self.entity, index, self.columns, strict=True)


def lines(entity: str, names: Sequence[str], values: np.ndarray) -> Layer:
    """Make a layer with a line for each of k names over n frames, of (n, k) values.

    Args:
        entity: path of the entity.
        names: the k names.
        values: (n, k) values.
    """
    n, k = values.shape
    style = rr.SeriesLines(names=list(names), colors=[marker_colour(i) for i in range(k)])
    columns = rr.Scalars.columns(scalars=values.ravel()).partition([k] * n)
    return Layer(entity, (style,), np.arange(n), tuple(columns))


def entity_of(*parts: str) -> str:
    """Build the path of an entity from names that may hold any character."""
    return rr.new_entity_path(list(parts))


def marker_colour(index: int) -> Rgb:
    """Choose a colour for the marker of this index; neighbours differ by 0.618 of the colour wheel."""
    red, green, blue = (round(255 * part) for part in hsv_to_rgb((0.08 + index * GOLDEN_RATIO) % 1.0, 0.55, 1.0))
    return red, green, blue
