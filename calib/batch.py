"""Reports of several sessions and the index that lists them."""

from collections.abc import Sequence
from pathlib import Path

from calib.options import Options
from calib.pipeline import open_session
from calib.working import working
from reports import IndexEntry, write_index


def report_batch(
    folders: Sequence[Path], options: Options, index: Path | None
) -> tuple[tuple[Path, ...], tuple[str, ...]]:
    """Writes the report of what stands in each session, and an index of several; the files, and what they are.

    Args:
        folders: the sessions.
        options: threads.
        index: where the index goes; default `index.html` beside the first session.
    """
    entries, files, notes = [], [], []
    for folder in folders:
        open_session(folder)  # all faults of all sessions first
    for folder in folders:
        with working(folder, False, options) as pipeline:
            files.append(pipeline.report())
        fit = pipeline.the_fit()
        entries.append(IndexEntry.from_calibration(pipeline.session.name, files[-1], fit.result()))
        notes.append(f"{pipeline.session.name}: {fit.name}")
        notes += pipeline.said
    if len(entries) > 1 or index is not None:
        target = index or folders[0].resolve().parent / "index.html"
        write_index(target, entries)
        files.append(target)
    return tuple(files), tuple(notes)
