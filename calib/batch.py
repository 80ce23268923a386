"""Several sessions at a time: each in a process of its own, and a broken one stops no other."""

import sys
from collections.abc import Mapping, Sequence
from functools import partial
from os import cpu_count
from pathlib import Path
from time import monotonic
from typing import NamedTuple

from calib.options import EffortName, Options
from calib.pipeline import Pipeline, working
from calib.spread import spread
from session.errors import NotConverged


def run_pipeline(pipeline: Pipeline) -> None:
    """Everything that the data allow; with full effort posterior and diagnosis too."""
    if pipeline.only_dry:
        pipeline.structured()
        return
    pipeline.fit()
    if pipeline.options.effort == "full":
        try:
            pipeline.posterior()
        except NotConverged as refusal:  # a note: the other results do not need it
            pipeline.notes.append(f"! {refusal}")
        pipeline.diagnosis()
    pipeline.report()


class Ended(NamedTuple):
    """How the run of a session ended."""

    folder: Path
    error: str  # why it failed; empty if it did not
    seconds: float


def run_all(
    folders: Sequence[Path],
    effort: EffortName,
    jobs: int = 1,
    workers: int = 0,
    progress: bool = False,
    scheduler: str | None = None,
) -> Mapping[Path, str]:
    """Runs all sessions, `jobs` at a time, and says when each is done; why sessions failed, by folder.

    Threads of each, `workers`: 0 for its share of the cores, one where a dask scheduler is given, whose workers run the
    sessions; they need to see the same folders.

    Raises:
        InputError: of the scheduler or its workers.
    """
    threads = workers or (1 if scheduler else max((cpu_count() or 1) // jobs, 1))
    failures: dict[Path, str] = {}
    given = {folder.resolve(): folder for folder in folders}
    work = partial(_run_one, effort=effort, workers=threads)
    for done, ended in enumerate(spread(work, list(given), _lost, jobs, scheduler), 1):
        if ended.error:
            failures[given[ended.folder]] = ended.error
        if progress:
            state = f"{'failed' if ended.error else 'done'} after {ended.seconds:.0f} s, {done} of {len(folders)}"
            print(f"calib: {ended.folder.name}: {state}", file=sys.stderr, flush=True)
    return failures


def _run_one(folder: Path, effort: EffortName, workers: int) -> Ended:
    began, error = monotonic(), ""
    try:
        with working(folder, True, Options(effort, workers)) as pipeline:
            run_pipeline(pipeline)
    except Exception as problem:  # whatever it is, it is this session's and no other's
        error = str(problem) or type(problem).__name__
    return Ended(folder, error, monotonic() - began)


def _lost(folder: Path, why: str) -> Ended:
    return Ended(folder, f"{folder}: not finished; found: {why}", float("nan"))
