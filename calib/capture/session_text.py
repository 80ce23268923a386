"""The text of `session.toml`: made where there is none, and trials appended, all else left as the user wrote it."""

import contextlib
import json
import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from calib.capture.errors import UserError

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
