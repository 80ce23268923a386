"""The form of ``session.toml``: its tables, keys and the range of each value."""

from __future__ import annotations

import re
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, StringConstraints

from session.camera import Positive
from session.toml_source import Table, key_error

TrialKind = Literal["free_decay", "dry", "swim"]
TrialRole = Literal["fit", "holdout"]

HEAD_MARKERS = ("nose", "neck")
"""The markers that make the head frame; every session needs them."""

FEWEST_MARKERS = 3
FASTEST_HZ = 15.0
"""Fastest crank, turns a second, as fast as Tunabot beats (Zhu et al., Sci. Robot. 4, 2019).

Larger numbers are taken for turns a minute.
"""


def _safe_name(name: str) -> str:
    """Check that a name can be part of a file's name on any system, and return it."""
    if len(name) > 100 or not re.fullmatch(r"[A-Za-z0-9_]([A-Za-z0-9_.-]*[A-Za-z0-9_-])?", name):
        raise key_error("not a usable name", expected="up to 100 letters, digits, _, - and . within, such as f1_00")
    return name


def _turns_a_second(hz: float) -> float:
    if hz > FASTEST_HZ:
        expected = f"crank turns a second, at most {FASTEST_HZ:g}"
        step = f"Turns a minute? Divide by 60: {hz / 60:.4g}."
        raise key_error("faster than a tail is driven", expected=expected, next_step=step)
    return hz


FileName = Annotated[str, StringConstraints(min_length=1)]
Name = Annotated[str, AfterValidator(_safe_name)]


class SessionTable(Table):
    """The table ``[session]``."""

    name: Annotated[str, StringConstraints(min_length=1, max_length=200)]


class RobotTable(Table):
    """The table ``[robot]``."""

    file: FileName


class CameraTable(Table):
    """The table ``[camera]``."""

    fps: Positive
    scale_length_m: Positive
    calibration: FileName | None = None


class MarkersTable(Table):
    """The table ``[markers]``."""

    names: Annotated[tuple[Name, ...], Field(min_length=FEWEST_MARKERS)]
    rename: Annotated[dict[str, str], Field(default_factory=dict)]


class FitTable(Table):
    """The table ``[fit]``."""

    warmup_s: Annotated[float, Field(ge=0)] = 1.0
    seed: Annotated[int, Field(ge=0)] = 0


class TrialTable(Table):
    """One table ``[[trial]]``."""

    name: Name
    kind: TrialKind
    tracks: FileName | None = None
    video: FileName | None = None
    boxes: FileName | None = None
    motor: FileName | None = None
    motor_offset_s: float = 0.0
    commanded_hz: Annotated[Positive, AfterValidator(_turns_a_second)] | None = None
    role: TrialRole = "fit"


class SessionFile(Table):
    """All tables of ``session.toml``."""

    session: SessionTable
    robot: RobotTable | None = None
    camera: CameraTable
    markers: MarkersTable
    fit: FitTable = FitTable()
    trial: Annotated[tuple[TrialTable, ...], Field(min_length=1)]
