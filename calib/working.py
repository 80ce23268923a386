"""A session under work: locked, with progress."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from calib.options import Options
from calib.pipeline import Pipeline, open_session
from calib.progress import progress_bar
from session.folder import SESSION_FILE
from session.lock import session_lock


@contextmanager
def working(folder: Path, quiet: bool, options: Options | None = None) -> Iterator[Pipeline]:
    """A locked session and its pipeline, with progress unless quiet.

    Args:
        folder: of the session, or its `session.toml`.
        quiet: no progress.
        options: effort, threads, methods; who is told of the progress is replaced.
    """
    session = open_session(folder.parent if folder.name == SESSION_FILE else folder)
    with session_lock(session.folder), progress_bar(quiet) as tell:
        yield Pipeline(session, (options or Options()).telling(tell))
