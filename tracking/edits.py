"""Corrections by hand: the kinds of edit, the log of all, and how they are applied.

The `EditLog` is a file of what a person corrected, one JSON object a line, only ever added to:

    # lines that start with # and blank lines are for the reader
    {"op": "swap", "markers": ["tail_3", "tail_4"], "frames": [120, null]}
    {"op": "drop", "markers": ["nose"], "frames": [50, 61], "note": "glint"}
    {"op": "relabel", "marker": "tail_1", "to": "tail_2", "frames": [10, 20]}
    {"op": "box", "marker": "caudal_fin", "frame": 200, "box": [310, 95, 20, 20], "until": 240}
    {"op": "undo", "line": 3}

Frames are the first and the last one, both included; null for the last means to the end. An edit is undone by a
further line that names its line in the file; an undo can be undone too. Nothing is removed or changed.

`apply_edits` replays the log on a tracked trial: it makes a copy, and never changes the tracker's own samples.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

import numpy as np
import xarray as xr
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from swimcal.errors import FaultCollector, did_you_mean, shown
from swimcal.flags import Flag
from swimcal.results import writing_whole
from swimcal.tables import read_text
from swimcal.toml import fault_of, key_error
from swimcal.tracks import markers_of
from tracking.boxes import Box
from tracking.tracked import NO_SAMPLE, ONLY_CSRT, SampleState, only_csrt_flags, samples_of, with_samples

FrameNumber = Annotated[int, Field(ge=0)]
Side = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Coordinate = Annotated[float, Field(allow_inf_nan=False)]

EXAMPLE = 'one edit, as {"op": "drop", "markers": ["nose"], "frames": [50, 61]}'


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


class LoggedEdit(NamedTuple):
    """One edit and the line of the file it is on, counted from 1."""

    line: int
    edit: Edit


@dataclass(frozen=True)
class EditLog:
    """The edits of one trial.

    Attributes:
        path: the file; it need not be there as long as nothing was edited.
        markers: those that edits may name.
        frames: how many the trial has; None if not known.
        edits: all edits in the order of the file, undone ones too.
    """

    path: Path
    markers: tuple[str, ...]
    frames: int | None = None
    edits: tuple[LoggedEdit, ...] = ()

    @classmethod
    def load(cls, path: Path, markers: Sequence[str], frames: int | None = None) -> EditLog:
        """Read a log; one that is not there is empty.

        Args:
            path: the file.
            markers: names that edits may use.
            frames: number of frames of the trial; None if not known.

        Raises:
            InputError: every fault of the file at once, with its lines.
        """
        log = cls(path, tuple(markers), frames)
        if not path.exists():
            return log
        faults = FaultCollector(str(path))
        for line, text in enumerate(read_text(path).replace("\r\n", "\n").split("\n"), start=1):
            if text.strip() and not text.lstrip().startswith("#"):
                log = log._with(line, _parse(text, line, faults), faults)
        faults.raise_if_any()
        return log

    def append(self, text: str, check: Callable[[Edit], None] | None = None) -> EditLog:
        """Add an edit at the end of the file, and return the log with it.

        The file is made when it is not there; all that is there stays.

        Args:
            text: the edit in JSON, as a line of the file has it.
            check: a further check of the edit, which raises an `InputError`.

        Raises:
            InputError: not an edit, or one that names a marker, frame or line that is not there, or the file has
                faults;
                nothing is written.
            ResultsNotWritable: the file cannot be written.
        """
        faults = FaultCollector("the edit")
        edit = _parse(text, 1, faults)
        faults.raise_if_any()
        assert edit is not None
        log = EditLog.load(self.path, self.markers, self.frames)
        before = self.path.read_bytes() if self.path.exists() else b""
        before += b"" if before.endswith(b"\n") or not before else b"\n"
        faults = FaultCollector(str(self.path))
        log = log._with(before.count(b"\n") + 1, edit, faults)
        faults.raise_if_any()
        if check is not None:
            check(edit)
        with writing_whole(self.path) as part:
            part.write_bytes(before + _as_line(edit).encode() + b"\n")
        return log

    @property
    def in_force(self) -> tuple[LoggedEdit, ...]:
        """The edits that count, in order: neither undone nor undos themselves."""
        undone: set[int] = set()
        for line, edit in reversed(self.edits):
            if isinstance(edit, Undo) and line not in undone:
                undone.add(edit.line)
        return tuple(one for one in self.edits if not isinstance(one.edit, Undo) and one.line not in undone)

    def _with(self, line: int, edit: Edit | None, faults: FaultCollector) -> EditLog:
        """Return the log with one more edit, and add a fault for each unknown marker, frame or line in it."""
        if edit is None:
            return self
        where = f"line {line}, {edit.op}"
        for name in dict.fromkeys(edit.named):
            if name not in self.markers:
                hint = did_you_mean(name, self.markers)
                faults.add(where, "no such marker", found=repr(name), choices=self.markers, next_step=hint)
        if self.frames is not None and (beyond := [str(frame) for frame in edit.framed if frame >= self.frames]):
            faults.add(where, "no such frame", found=", ".join(beyond), expected=f"0 to {self.frames - 1}")
        earlier = [str(one.line) for one in self.edits]
        if isinstance(edit, Undo) and str(edit.line) not in earlier:
            expected = "the line of an edit above it" if earlier else "an edit above it, and there is none"
            faults.add(where, "no edit to undo", found=f"line {edit.line}", expected=expected, choices=earlier)
        return EditLog(self.path, self.markers, self.frames, (*self.edits, LoggedEdit(line, edit)))


def _as_line(edit: Edit) -> str:
    """Return the edit as a line of JSON: its operation first, its frames and its note last."""
    keys = edit.model_dump(mode="json", exclude_none=True)
    order = [key for key in keys if key not in ("op", "frames", "note")]
    ordered = ["op", *order, *(["frames"] if "frames" in keys else []), *(["note"] if edit.note else [])]
    return json.dumps({key: keys[key] for key in ordered}, ensure_ascii=False)


def _parse(text: str, line: int, faults: FaultCollector) -> Edit | None:
    """Return the edit on one line, or None with a fault for what is wrong with it."""
    where = f"line {line}"
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        faults.add(where, "not JSON", found=f"{shown(text)}: {error}", expected=EXAMPLE)
        return None
    name = content.get("op") if isinstance(content, dict) else None
    if not isinstance(name, str) or name not in EDITS:
        found = shown(name if isinstance(content, dict) else content)
        hint = did_you_mean(str(name), EDITS)
        faults.add(where, "no operation of the edit log", found=found, expected=EXAMPLE, choices=EDITS, next_step=hint)
        return None
    try:
        return EDITS[name].model_validate_json(text)
    except ValidationError as error:
        for details in error.errors():
            place = ".".join([f"{where}, {name}", *map(str, details["loc"])])
            faults.extend([fault_of(EDITS[name], details, faults.file, place)])
    return None


Retracker = Callable[[np.ndarray, int, SetBox], tuple[np.ndarray, tuple[Flag, ...]]]
"""Function that tracks a marker on from a box set by hand.

It takes the places (n, m, 2) of all markers, px, the number of the one, and its box; it gives the samples, (f,) of
`SAMPLE`, of that marker in the frames after the box, and what is doubtful.
"""


def apply_edits(tracked: xr.Dataset, log: EditLog, retrack: Retracker | None = None) -> xr.Dataset:
    """Replay the edits that count, in the order of the log.

    A sample that is swapped or relabelled keeps its state, confidence and size under its new name; one that is dropped
    is MISSING. A box set by hand makes the sample of its frame BY_HAND with confidence 1, at the centre of the box; the
    frames after it are what `retrack` finds, or stay as they are without one. Each edit leaves a flag ``edited`` that
    names it. Flags ``only_csrt`` go with their samples; other flags of the tracker stay: judge the quality again after
    the edits.

    Args:
        tracked: the trial as tracked.
        log: its edits.
        retrack: tracks a marker on from a box set by hand.
    """
    if not log.in_force:
        return tracked
    names, samples = markers_of(tracked), samples_of(tracked)
    flags = [flag for flag in tracked.flags if flag.kind != ONLY_CSRT]
    for logged in log.in_force:
        flags.append(_describe_edit(logged, len(samples)))
        match logged.edit:
            case Swap(markers=(a, b), span=span):
                pair = [names.index(a), names.index(b)]
                samples[span, pair] = samples[span, pair[::-1]]
            case Drop(markers=markers, span=span):
                samples[span, [names.index(name) for name in markers]] = NO_SAMPLE
            case Relabel(marker=marker, to=to, span=span):
                samples[span, names.index(to)] = samples[span, names.index(marker)]
                samples[span, names.index(marker)] = NO_SAMPLE
            case SetBox(marker=marker, frame=frame) as box:
                k = names.index(marker)
                samples[frame, k] = (Box(*box.box).centre_px, 1.0, SampleState.BY_HAND, np.nan, False)
                if retrack is not None:
                    found, new_flags = retrack(samples["position_px"], k, box)
                    samples[frame + 1 : frame + 1 + len(found), k] = found
                    flags += new_flags
    return with_samples(tracked, samples, (*only_csrt_flags(samples["by_csrt"], names), *flags))


def _describe_edit(logged: LoggedEdit, frames: int) -> Flag:
    line, edit = logged
    match edit:
        case Swap(markers=(a, b)):
            what = f"{a} and {b} swapped"
        case Drop(markers=markers):
            what = f"{', '.join(markers)} dropped"
        case Relabel(marker=marker, to=to):
            what = f"{marker} relabelled as {to}"
        case _:
            what = f"{', '.join(edit.named)} set"
    first, *last = edit.framed
    to_the_end = not isinstance(edit, SetBox)
    stop = last[0] if last else frames - 1 if to_the_end else first
    why = f": {edit.note}" if edit.note else ""
    return Flag("edited", edit.named, (first, stop), f"{what} by hand (line {line} of the edit log){why}")
