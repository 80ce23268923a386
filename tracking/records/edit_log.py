"""The edit log: what a person corrected, one JSON object a line, only ever added to.

    # lines that start with # and blank lines are for the reader
    {"op": "swap", "markers": ["tail_3", "tail_4"], "frames": [120, null]}
    {"op": "drop", "markers": ["nose"], "frames": [50, 61], "note": "glint"}
    {"op": "relabel", "marker": "tail_1", "to": "tail_2", "frames": [10, 20]}
    {"op": "box", "marker": "caudal_fin", "frame": 200, "box": [310, 95, 20, 20], "until": 240}
    {"op": "undo", "line": 3}

Frames are the first and the last one, both included; null for the last means to the end. An edit is undone by a
further line that names its line in the file; an undo can be undone too. Nothing is removed or changed.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from pydantic import ValidationError

from session import FaultCollector
from session.errors import did_you_mean, shown
from session.results import writing_whole
from session.tables import read_text
from session.toml_source import fault_of
from tracking.records.edit import EDITS, Edit, Undo

EXAMPLE = 'one edit, as {"op": "drop", "markers": ["nose"], "frames": [50, 61]}'


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

    def append(self, text: str) -> EditLog:
        """Add an edit at the end of the file, and return the log with it.

        The file is made when it is not there; all that is there stays.

        Args:
            text: the edit in JSON, as a line of the file has it.

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
