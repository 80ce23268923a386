"""Reports of several sessions and the index that lists them."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from calib.options import Options
from calib.pipeline import open_session
from calib.working import working
from reports import IndexEntry, write_index


def report_batch(folders: Sequence[Path], options: Options, index: Path | None) -> Iterator[Path]:
    """Writes the report of what stands in each session and yields it; the index comes last when there are several.

    Args:
        folders: the sessions.
        options: threads.
        index: where the index goes; default `index.html` beside the first session.
    """
    entries = []
    for folder in folders:
        open_session(folder)  # all faults of all sessions first
    for folder in folders:
        with working(folder, False, options) as pipeline:
            path = pipeline.report()
        entries.append(IndexEntry.from_calibration(pipeline.session.name, path, pipeline.the_fit().result()))
        yield path
    if len(entries) > 1 or index is not None:
        target = index or folders[0].resolve().parent / "index.html"
        write_index(target, entries)
        yield target
