"""Track faults: what a tracker does wrong over a stretch of frames, by the kind of flag it should raise."""

from collections.abc import Iterable
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from session.toml_source import Table

Pixels = tuple[float, float]  # x to the right, y down


class _Stretch(Table):
    """A marker and the frames in which its box is wrong.

    Attributes:
        marker: whose box.
        first: the first wrong frame, counted from 0.
        frames: how many frames in a row.
    """

    marker: str
    first: Annotated[int, Field(ge=0)]
    frames: Annotated[int, Field(ge=1)]

    @property
    def last(self) -> int:
        """The last wrong frame."""
        return self.first + self.frames - 1

    @property
    def span(self) -> slice:
        """The wrong frames."""
        return slice(self.first, self.first + self.frames)


class Merge(_Stretch):
    """The box sits on another marker, but for a constant offset between the two boxes."""

    kind: Literal["merged_markers"] = "merged_markers"
    onto: str
    offset_px: Pixels = (1.5, -1.0)

    @model_validator(mode="after")
    def _two_markers(self) -> "Merge":
        if self.onto == self.marker:
            raise ValueError(f"{self.marker} cannot merge onto itself; name another marker in `onto`")
        return self

    def apply(self, position_px: np.ndarray, markers: tuple[str, ...]) -> None:
        """Writes the fault into (n, m, 2) positions."""
        onto = position_px[self.span, markers.index(self.onto)]
        position_px[self.span, markers.index(self.marker)] = onto + np.array(self.offset_px)


class Freeze(_Stretch):
    """The box stays where it was in the first of the frames."""

    kind: Literal["frozen_marker"] = "frozen_marker"

    def apply(self, position_px: np.ndarray, markers: tuple[str, ...]) -> None:
        """Writes the fault into (n, m, 2) positions."""
        number = markers.index(self.marker)
        position_px[self.span, number] = position_px[self.first, number]


class Jump(_Stretch):
    """The box jumps to a place at a constant distance from the marker, and back after the last frame."""

    kind: Literal["jump"] = "jump"
    offset_px: Pixels

    def apply(self, position_px: np.ndarray, markers: tuple[str, ...]) -> None:
        """Writes the fault into (n, m, 2) positions."""
        position_px[self.span, markers.index(self.marker)] += np.array(self.offset_px)


class Gap(_Stretch):
    """The marker is not seen."""

    kind: Literal["gap"] = "gap"

    def apply(self, position_px: np.ndarray, markers: tuple[str, ...]) -> None:
        """Writes the fault into (n, m, 2) positions."""
        position_px[self.span, markers.index(self.marker)] = np.nan


TrackFault = Annotated[Merge | Freeze | Jump | Gap, Field(discriminator="kind")]
"""Any of the faults; told apart by `kind` where read from a file."""


def with_faults(position_px: np.ndarray, markers: tuple[str, ...], faults: Iterable[TrackFault]) -> np.ndarray:
    """Tracks with faults, which apply in the order given.

    Args:
        position_px: (n, m, 2) of the boxes; left as it is.
        markers: names of the m markers.
        faults: each within the n frames.

    Returns:
        (n, m, 2) px; nan in gaps.
    """
    faulty = position_px.copy()
    for fault in faults:
        fault.apply(faulty, markers)
    return faulty
