"""Corrections that a person can make in a tracked trial: one class for each operation of the edit log."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from session.toml_source import key_error

FrameNumber = Annotated[int, Field(ge=0)]
Side = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Coordinate = Annotated[float, Field(allow_inf_nan=False)]


class _Edit(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    note: str = ""
    """Free text: why, who, when."""

    @property
    def named(self) -> tuple[str, ...]:
        """Names of the markers in the edit."""
        one_by_one = (getattr(self, key) for key in ("marker", "to") if hasattr(self, key))
        return (*getattr(self, "markers", ()), *one_by_one)

    @property
    def framed(self) -> tuple[int, ...]:
        """Numbers of the frames in the edit."""
        one_by_one = (getattr(self, key) for key in ("frame", "until") if hasattr(self, key))
        return tuple(frame for frame in (*getattr(self, "frames", ()), *one_by_one) if frame is not None)


class _Stretch(_Edit):
    frames: tuple[FrameNumber, FrameNumber | None] = (0, None)
    """First and last, both included; None for the last means to the end."""

    @model_validator(mode="after")
    def _in_order(self) -> _Stretch:
        first, last = self.frames
        if last is not None and last < first:
            raise key_error("the frames are the wrong way round", found=f"{first} to {last}", expected="first, last")
        return self

    @property
    def span(self) -> slice:
        """Frames of the edit, as a slice."""
        first, last = self.frames
        return slice(first, None if last is None else last + 1)


class Swap(_Stretch):
    """Two markers change their samples."""

    op: Literal["swap"] = "swap"
    markers: tuple[str, str]

    @model_validator(mode="after")
    def _two(self) -> Swap:
        if self.markers[0] == self.markers[1]:
            raise key_error("one marker twice", found=repr(self.markers[0]), expected="two different markers")
        return self


class Drop(_Stretch):
    """The samples of some markers are wrong; they become missing."""

    op: Literal["drop"] = "drop"
    markers: Annotated[tuple[str, ...], Field(min_length=1)]


class Relabel(_Stretch):
    """Correction of a name: samples of `marker` belong to the marker `to`, whose own samples there were wrong."""

    op: Literal["relabel"] = "relabel"
    marker: str
    to: str

    @model_validator(mode="after")
    def _two(self) -> Relabel:
        if self.marker == self.to:
            raise key_error("a marker relabelled as itself", found=repr(self.to), expected="another marker in `to`")
        return self


class SetBox(_Edit):
    """Box of a marker in one frame: x, y of the top left pixel, width and height, px.

    From there it is tracked on, until the last frame given; None leaves it to the tracker.
    """

    op: Literal["box"] = "box"
    marker: str
    frame: FrameNumber
    box: tuple[Coordinate, Coordinate, Side, Side]
    until: FrameNumber | None = None

    @model_validator(mode="after")
    def _in_order(self) -> SetBox:
        if self.until is not None and self.until < self.frame:
            expected = f"a frame from {self.frame} on"
            raise key_error("the last frame is before that of the box", found=f"until {self.until}", expected=expected)
        return self


class Undo(_Edit):
    """The edit on an earlier line of the log does not count."""

    op: Literal["undo"] = "undo"
    line: Annotated[int, Field(ge=1)]


Edit = Swap | Drop | Relabel | SetBox | Undo
EDITS: dict[str, type[Edit]] = {"swap": Swap, "drop": Drop, "relabel": Relabel, "box": SetBox, "undo": Undo}
"""The kinds of edit by the name of their operation."""
