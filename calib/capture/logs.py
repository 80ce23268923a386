"""Logs of captured trials, and the text of their session.

A `TrialLog` is written row by row while the motor runs. `SessionText` is the text of `session.toml`: made where there
is none, and trials appended, all else left as the user wrote it.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

from calib.capture import registers
from calib.capture.bus import UserError
from calib.capture.motor import Reading
from calib.capture.registers import TurnCounter

MOTOR_HEADER = "time_s,position_rad,velocity_rad_s,current_a,voltage_v,temperature_c,error"
COMMANDS_HEADER = "time_s,part,velocity_rad_s"
FEWEST_ROWS = 2
"""Number of rows that a log must have: a session takes none with fewer."""

SESSION_FILE = "session.toml"

NEW_SESSION = """\
[session]
name = {name}

[camera]
fps = 60.0               # nominal: set your camera's
scale_length_m = 0.142   # nose to neck

[markers]
names = ["nose", "neck", "dorsal_fin", "tail_1", "tail_2", "tail_3", "tail_4", "tail_5", "caudal_fin"]
"""

TRIAL = """
[[trial]]
name = {name}
kind = {kind}
motor = {motor}
commanded_hz = {hz}
role = {role}
"""


class TrialLog:
    """The log files ``<name>.motor.csv``, what was measured, and ``<name>.commands.csv``, what was commanded and when.

    Each row is handed to the operating system at once, so that it outlives this program. Where fewer than
    `FEWEST_ROWS` were measured, both files are removed at the end.
    """

    def __init__(self, folder: Path, name: str) -> None:
        self.path = folder / f"{name}.motor.csv"
        self.rows = 0
        self.first_s = math.nan
        self.last_s = -math.inf
        self._steady: list[tuple[float, int]] = []  # times (s) and positions (pulses) of the first and last steady row
        self._commands_path = folder / f"{name}.commands.csv"
        self._position = TurnCounter(2**32)
        self._motor: TextIO | None = None
        self._commands: TextIO | None = None

    def __enter__(self) -> TrialLog:
        try:
            self._motor = _start_file(self.path, MOTOR_HEADER)
            self._commands = _start_file(self._commands_path, COMMANDS_HEADER)
        except UserError:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        for file in (self._motor, self._commands):
            if file is not None:
                _close(file)
                if self.rows < FEWEST_ROWS:
                    Path(file.name).unlink(missing_ok=True)

    def measured(self, reading: Reading, steady: bool) -> None:
        """Add a row of what was measured.

        A row whose time is unsure, or not later than the last, is left out. The mean speed is that of the `steady`
        rows.
        """
        time_s = round(reading.time_s, 6)
        value = reading.measured
        position = self._position.follow(value.position)
        if time_s <= self.last_s or not reading.timely:
            return
        assert self._motor is not None
        _append(
            self._motor,
            f"{time_s:.6f},{2 * math.pi * position / registers.PULSES:.6f},{registers.rad_per_s(value.velocity):.5f},"
            f"{value.current * registers.AMPERE:.4f},{value.voltage * registers.VOLT:.1f},{value.temperature},"
            f"{reading.hardware_error}",
        )
        self.first_s = time_s if self.rows == 0 else self.first_s
        self.last_s = time_s
        self.rows += 1
        if steady:
            self._steady = [*self._steady[:1], (reading.time_s, position)]

    def commanded(self, time_s: float, part: str, units: int) -> None:
        """Add a row of what was commanded.

        Args:
            time_s: when the motor got the command, s.
            part: the part of the trial, such as "drive".
            units: the goal velocity in its own units.
        """
        assert self._commands is not None
        _append(self._commands, f"{time_s:.6f},{part},{registers.rad_per_s(units):.5f}")

    @property
    def mean_hz(self) -> float:
        """Turns a second between the first and the last steady row; nan with fewer than two."""
        if len(self._steady) < 2:
            return math.nan
        (first_s, first), (last_s, last) = self._steady
        return (last - first) / registers.PULSES / (last_s - first_s)

    @property
    def rate_hz(self) -> float:
        """Rows a second; nan with fewer than two."""
        return (self.rows - 1) / (self.last_s - self.first_s) if self.rows >= FEWEST_ROWS else math.nan


def _start_file(path: Path, header: str) -> TextIO:
    try:
        file = path.open("x", encoding="utf-8", newline="\n")
    except OSError as error:
        raise UserError(f"{path}: cannot be written; found: {error.strerror or error}") from error
    _append(file, header)
    return file


def _append(file: TextIO, row: str) -> None:
    try:
        file.write(row + "\n")
        file.flush()
    except OSError as error:
        raise UserError(
            f"{file.name}: cannot be written; found: {error.strerror or error}. Is the disk full?"
        ) from error


def _close(file: TextIO) -> None:
    """Close the file, with its content on the disk itself, should the power go next."""
    with contextlib.suppress(OSError):  # a full disk was reported when the row was written
        file.flush()
        os.fsync(file.fileno())
    with contextlib.suppress(OSError):
        file.close()


@dataclass(frozen=True)
class SessionText:
    """The session in a folder that trials are added to."""

    folder: Path

    @property
    def path(self) -> Path:
        """The path of `session.toml`."""
        return self.folder / SESSION_FILE

    @property
    def trials(self) -> Path:
        """The folder of the recordings."""
        return self.folder / "trials"

    def check(self) -> None:
        """Raise a `UserError` where no trial can be added to what is there; nothing is written."""
        self._with_trial("x", "dry", 1.0, "fit")

    def make_folders(self) -> None:
        """Make the folders where they are missing; a `UserError` says why they cannot be made or written to."""
        try:
            self.trials.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise UserError(_explain_not_writable(self.trials, error)) from error
        if not (os.access(self.folder, os.W_OK) and os.access(self.trials, os.W_OK)):
            raise UserError(f"{self.folder}: not writable; choose a folder that you may write to with --out")

    def taken_names(self) -> list[str]:
        """List the names that a new trial must not have: those of the trials, and of the logs that are there."""
        listed = [str(trial.get("name")) for trial in _parse(self.path, self._text()).get("trial", ())]
        logs = [path.name.split(".")[0] for path in self.trials.glob("*.csv")]
        return listed + logs

    def add_trial(self, name: str, kind: str, hz: float, role: str) -> None:
        """Append a trial whose motor log is in ``trials``; the file is replaced whole or not at all.

        Args:
            name: name of the trial, and of its log.
            kind: "swim" or "dry".
            hz: crank turns a second.
            role: "fit" or "holdout".

        Raises:
            UserError: it cannot be written, or was made such that no trial can be appended.
        """
        text = self._with_trial(name, kind, hz, role)
        part = self.path.with_name(f".{SESSION_FILE}.{os.getpid()}.part")
        try:
            with part.open("w", encoding="utf-8", newline="") as file:
                file.write(text)
                file.flush()
                os.fsync(file.fileno())
            part.replace(self.path)
        except OSError as error:
            raise UserError(_explain_not_writable(self.path, error)) from error
        finally:
            with contextlib.suppress(OSError):
                part.unlink(missing_ok=True)

    def _with_trial(self, name: str, kind: str, hz: float, role: str) -> str:
        """Return the text with one more trial, proven to hold what the old one held and that trial."""
        old = self._text()
        texts = {"name": name, "kind": kind, "motor": f"trials/{name}.motor.csv", "role": role}
        entry = TRIAL.format(**{key: _string(text) for key, text in texts.items()}, hz=repr(float(hz)))
        new = old.rstrip("\n") + "\n" + entry
        before = _parse(self.path, old)
        added = {**texts, "commanded_hz": float(hz)}
        try:
            good = tomllib.loads(new) == {**before, "trial": [*before.get("trial", ()), added]}
        except ValueError:
            good = False
        if not good:
            raise UserError(
                f"{self.path}: no trial can be appended; expected: trials as [[trial]] tables. "
                "Write them so, or choose another folder with --out."
            )
        return new

    def _text(self) -> str:
        """Read the file's text; that of a new one where there is none."""
        try:
            with self.path.open(encoding="utf-8-sig", newline="") as file:
                return file.read()
        except FileNotFoundError:
            return NEW_SESSION.format(name=_string(self.folder.resolve().name[:200] or "capture"))
        except (OSError, ValueError) as error:
            raise UserError(f"{self.path}: cannot be read; found: {error}; expected: TOML in UTF-8") from error


def _parse(path: Path, text: str) -> Mapping[str, Any]:
    try:
        return tomllib.loads(text)
    except ValueError as error:
        raise UserError(f"{path}: not valid TOML; found: {error}. Mend it first, or choose another folder.") from error


def _string(text: str) -> str:
    """Format a TOML basic string; JSON's escapes are TOML's."""
    return json.dumps(text, ensure_ascii=False)


def _explain_not_writable(path: Path, error: OSError) -> str:
    return f"{path}: cannot be written; found: {error.strerror or error}; choose a folder that you may write to"
