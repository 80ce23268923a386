"""Work on several sessions at a time: each in a process of its own, and a broken one stops no other."""

import sys
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from os import cpu_count
from pathlib import Path
from time import monotonic
from typing import NamedTuple

from calib.kept_output import keep_output
from calib.options import EffortName, LastStepName, Options
from calib.pipeline import Pipeline, working
from calib.results.made import fit_result
from calib.results.result import Export
from calib.spread import spread
from reports import IndexEntry, write_index
from session.errors import NotConverged, SwimcalError

Work = Callable[[Pipeline], object]


def run_pipeline(pipeline: Pipeline, until: LastStepName = "diagnosis") -> None:
    """Make all results that the data allow, up to a last step; with quick effort only those that are not current."""
    if pipeline.only_dry:
        pipeline.structured()
        return
    pipeline.fit()
    full = pipeline.fits.effort == "full"
    if until != "fit" and (full or pipeline.current_posterior(pipeline.the_fit()) is None):
        try:
            pipeline.posterior()
        except NotConverged as refusal:  # a note suffices: the other results do not need the posterior
            pipeline.notes.append(f"! {refusal}")
    if until == "diagnosis" and (full or pipeline.current_diagnosis() is None):
        pipeline.diagnosis()
    pipeline.report()


class Ended(NamedTuple):
    """The end of the work on a session."""

    folder: Path
    error: str  # the reason of a failure; empty if it did not fail
    seconds: float


def run_all(
    folders: Sequence[Path],
    effort: EffortName | None,
    jobs: int = 1,
    workers: int = 0,
    progress: bool = False,
    scheduler: str | None = None,
    work: Work = run_pipeline,
) -> Mapping[Path, str]:
    """Work on all sessions, `jobs` at a time, and report when each is done.

    Args:
        folders: the session folders.
        effort: "quick" or "full"; None for that of the current results.
        jobs: sessions at a time.
        workers: threads of each; 0 for its share of the cores, or one with a dask scheduler.
        progress: report each session on standard error.
        scheduler: address of a dask scheduler, whose workers do the sessions; they need to see the same folders.
        work: done on each session; a function that can be pickled.

    Returns:
        Why sessions failed, by folder.

    Raises:
        InputError: faults of the scheduler or its workers.
    """
    threads = workers or (1 if scheduler else max((cpu_count() or 1) // jobs, 1))
    failures: dict[Path, str] = {}
    given = {folder.resolve(): folder for folder in folders}
    one = partial(_run_one, effort=effort, workers=threads, work=work)
    for done, ended in enumerate(spread(one, list(given), _lost, jobs, scheduler), 1):
        if ended.error:
            failures[given[ended.folder]] = ended.error
        if progress:
            state = f"{'failed' if ended.error else 'done'} after {ended.seconds:.0f} s, {done} of {len(folders)}"
            print(f"calib: {ended.folder.name}: {state}", file=sys.stderr, flush=True)
    return failures


def indexed(folders: Sequence[Path], index: str | Path | None, failures: Mapping[Path, str]) -> Export:
    """Write the reports of several sessions and their index; those that failed are listed with the reason.

    Args:
        folders: the session folders.
        index: path of the index; default: next to the first session.
        failures: why sessions failed, by folder.
    """
    entries, notes, failed = [], [], dict(failures)
    for folder in folders:
        if folder not in failed:
            try:
                entry, note = reported(folder)
                entries.append(entry)
                notes.append(note)
                continue
            except SwimcalError as problem:
                failed[folder] = str(problem)
        entries.append(IndexEntry(folder.absolute().name, error=failed[folder], folder=folder))
    path = Path(index) if index is not None else folders[0].resolve().parent / "index.html"
    page, table = write_index(path, entries)
    reports = [entry.report for entry in entries if entry.report is not None]
    return Export((*reports, table, page), tuple(notes), {folder.name: why for folder, why in failed.items()})


def reported(folder: Path) -> tuple[IndexEntry, str]:
    """Bring the report of a session up to date; return its entry in the index, and what the report shows."""
    with working(folder, True) as pipeline:
        page, fit, diagnosis = pipeline.report(), fit_result(pipeline), pipeline.current_diagnosis()
        keep_output(pipeline)
    gap, effort = None if diagnosis is None else diagnosis.read(), pipeline.the_fit().effort
    entry = IndexEntry(pipeline.session.name, page, fit.data, effort, fit.verdict, gap, folder=folder)
    return entry, " ".join([f"{pipeline.session.name}: {pipeline.standing}", *pipeline.notes])


def _run_one(folder: Path, effort: EffortName | None, workers: int, work: Work) -> Ended:
    began, error = monotonic(), ""
    try:
        with working(folder, True, Options(effort, workers)) as pipeline:
            work(pipeline)
    except Exception as problem:  # any error of one session must leave the others alone
        error = str(problem) or type(problem).__name__
    return Ended(folder, error, monotonic() - began)


def _lost(folder: Path, why: str) -> Ended:
    return Ended(folder, f"{folder}: not finished; found: {why}", float("nan"))
