"""The lock of a session, so that two runs never write the same results."""

from __future__ import annotations

import json
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path

from filelock import FileLock, Timeout

from session.errors import ResultsNotWritable, SessionLocked
from session.results import PARTS

LOCK = ".swimcal.lock"
HOLDER = ".holder.json"


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
