"""Stages of the work on a session: what is current, what is out of date, and who holds the lock.

A `Stage` stamps its results with what they were made from, so that what has not changed is not made again.
``results/.stages.json`` holds, for each main result, the fingerprint of what it was made from and the hash of what was
written. A result that was edited, deleted or made from something else is not current.

`session_lock` keeps two runs from writing the same results.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import socket
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

from filelock import FileLock, Timeout

from swimcal.errors import ResultsNotWritable, SessionLocked
from swimcal.results import PARTS, is_incomplete, plain_json, program_version, sha256_of, write_whole

STAMPS = ".stages.json"
STAMPS_LOCK = ".stages.lock"
KEPT = "kept"
"""Folder of results that were replaced by others."""
_SHORT = 8  # characters of a fingerprint that name the folder of results kept aside

LOCK = ".swimcal.lock"
HOLDER = ".holder.json"


class HasFingerprint(Protocol):
    """Anything that results may depend on."""

    @property
    def fingerprint(self) -> str:
        """A hash over everything that it depends on itself."""


class Stage:
    """One step of the work on a session: its inputs, their fingerprint, and the files that it makes.

    Args:
        file: the main result, somewhere in the session's ``results``.
        inputs: the sha256 of each input file by its name.
        settings: everything else that steers the stage.
        after: the stages, or other things with a fingerprint, that it builds on.
    """

    def __init__(
        self, file: Path, inputs: Mapping[str, str], settings: Mapping[str, Any], after: Iterable[HasFingerprint] = ()
    ) -> None:
        self.file, self._inputs, self._settings, self._after = file, inputs, settings, tuple(after)

    @cached_property
    def fingerprint(self) -> str:
        """A hash over everything that the results depend on; the order of inputs and settings does not matter."""
        return fingerprint_of(self._inputs, self._settings, (stage.fingerprint for stage in self._after))

    @property
    def is_current(self) -> bool:
        """Return whether the results were made from these inputs, and every file of the stage is as it was written."""
        stamp = _read(self._results).get(_name(self.file, self._results))
        if not isinstance(stamp, dict) or stamp.get("fingerprint") != self.fingerprint:
            return False
        outputs = stamp.get("outputs")
        if not isinstance(outputs, dict) or not outputs:
            return False
        try:
            return all(sha256_of(self._results / name) == sha256 for name, sha256 in outputs.items())
        except OSError:
            return False

    @property
    def incomplete(self) -> Path | None:
        """The first result file whose end is missing, as after a full disk; None where all are whole."""
        stamp = _read(self._results).get(_name(self.file, self._results))
        outputs = stamp.get("outputs") if isinstance(stamp, dict) else None
        names = outputs if isinstance(outputs, dict) else ()
        files = (self.file, *(self._results / name for name in names))
        return next((path for path in files if is_incomplete(path)), None)

    def ensure(self, make: Callable[[], Iterable[Path] | None]) -> bool:
        """Make the results unless they are current, and return whether that was needed.

        Args:
            make: makes the results, and returns the files that were written besides the main one.
        """
        if self.is_current:
            return False
        self.mark(make() or ())
        return True

    def mark(self, others: Iterable[Path] = ()) -> None:
        """Record that the main result, and the others, were just made from these inputs."""
        outputs = {_name(path, self._results): sha256_of(path) for path in (self.file, *others)}
        # The fingerprint may itself make and mark what this rests on, so it is found before the stamps are opened.
        stamp = {"fingerprint": self.fingerprint, "outputs": outputs}
        with _changed(self._results) as stamps:
            stamps[_name(self.file, self._results)] = stamp

    def keep_aside(self, with_it: Iterable[Path] = ()) -> Path | None:
        """Copy the results that are there to ``results/kept/<stamp>`` before others take their place.

        The stamp is the fingerprint that they were made under.

        Args:
            with_it: results that rest on these alone; they are moved instead of copied.

        Returns:
            The folder; None where nothing is there.
        """
        if not self.file.exists():
            return None
        stamps = _read(self._results)
        stamp = stamps.get(_name(self.file, self._results), {})
        folder = self._results / KEPT / str(stamp.get("fingerprint") or sha256_of(self.file))[:_SHORT]
        folder.mkdir(parents=True, exist_ok=True)
        for file in (self.file, *with_it):
            name = _name(file, self._results)
            outputs = {name, *stamps.get(name, {}).get("outputs", {})}
            for path in (self._results / output for output in outputs):
                if path.is_file():
                    shutil.copy2(path, folder)
                    if file != self.file:
                        path.unlink()
        with _changed(self._results) as stamps:
            for file in with_it:
                stamps.pop(_name(file, self._results), None)
        return folder

    @property
    def _results(self) -> Path:
        """The ``results`` folder that holds the main result."""
        for folder in self.file.parents:
            if folder.name == "results":
                return folder
        raise ValueError(f"{self.file} is not in a session's results folder")


def fingerprint_of(inputs: Mapping[str, str], settings: Mapping[str, Any], after: Iterable[str] = ()) -> str:
    """Compute a hash over everything that results depend on, this version too; the order does not matter.

    Args:
        inputs: the sha256 of each input file by its name.
        settings: everything else that steers the stage.
        after: fingerprints of what it builds on.
    """
    parts = [inputs, settings, sorted(after), program_version()]
    return hashlib.sha256(json.dumps(plain_json(parts), sort_keys=True).encode()).hexdigest()


def _name(path: Path, results: Path) -> str:
    return path.relative_to(results).as_posix()


def _read(results: Path) -> dict[str, Any]:
    """Read the stamps; none where the record is absent or damaged, so that every result is made again."""
    try:
        stamps = json.loads((results / STAMPS).read_bytes())
    except (OSError, ValueError, RecursionError):
        return {}
    return stamps if isinstance(stamps, dict) else {}


@contextmanager
def _changed(results: Path) -> Iterator[dict[str, Any]]:
    """Give the stamps, and write them after the block; stages that are made at the same time wait for each other."""
    with FileLock(results / STAMPS_LOCK):
        stamps = _read(results)
        yield stamps
        write_whole(results / STAMPS, json.dumps(stamps, indent=1, sort_keys=True) + "\n")


@contextmanager
def session_lock(folder: Path) -> Iterator[None]:
    """Hold the session's lock during the block, without waiting for it.

    The operating system drops the lock when its holder ends, however it ends: a killed run does not block
    the next. Who holds it is noted in ``results/.holder.json``, for the message only.

    Raises:
        SessionLocked: another run holds it.
        ResultsNotWritable: the session folder is not writable.
    """
    lock = FileLock(folder / LOCK, timeout=0)
    try:
        lock.acquire()
    except Timeout:
        raise SessionLocked(_describe_holder(folder)) from None
    except OSError as error:
        raise ResultsNotWritable(
            f"{folder}: the session cannot be locked; found: {error.strerror or error}; "
            "expected: a writable folder. Make it writable, or work on a copy of the session."
        ) from error
    try:
        for part in [*(folder / "results").glob(PARTS), *(folder / "results").glob(f"*/{PARTS}")]:
            with suppress(OSError):  # these are parts of killed runs: nobody else writes while the lock is held
                part.unlink()
        with _note_holder(folder / "results" / HOLDER):
            yield
    finally:
        lock.release()


@contextmanager
def _note_holder(holder: Path) -> Iterator[None]:
    """Write down who holds the lock during the block; a note that cannot be written is left out."""
    since = datetime.now(UTC).isoformat(timespec="seconds")
    note = {"pid": os.getpid(), "host": socket.gethostname(), "since": since}
    with suppress(OSError):
        holder.parent.mkdir(exist_ok=True)
        holder.write_text(json.dumps(note), encoding="utf-8")
    try:
        yield
    finally:
        with suppress(OSError):
            holder.unlink()


def _describe_holder(folder: Path) -> str:
    who = "another run"
    with suppress(OSError, ValueError, KeyError, TypeError):
        note = json.loads((folder / "results" / HOLDER).read_bytes())
        who = f"process {note['pid']} on {note['host']}, since {note['since']}"
    return (
        f"{folder}: this session is being worked on; found: its lock held by {who}; "
        "expected: one run at a time. Wait for that run, or end it; then start again."
    )
