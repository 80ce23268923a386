"""Several sessions at a time: each in a process of its own, and a broken one stops no other."""

import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from os import cpu_count
from pathlib import Path
from time import monotonic

from calib.options import EffortName, Options
from calib.pipeline import Pipeline, working
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


def run_all(folders: Sequence[Path], effort: EffortName, jobs: int, workers: int, progress: bool) -> Mapping[Path, str]:
    """Runs all sessions, and says when each is done.

    Args:
        folders: of the sessions.
        effort: how hard to search.
        jobs: sessions at a time.
        workers: threads of each; 0 for its share of the cores.
        progress: show it on standard error.

    Returns:
        Why sessions failed, by folder.
    """
    threads = workers or max((cpu_count() or 1) // jobs, 1)
    failures: dict[Path, str] = {}
    pool = ProcessPoolExecutor(jobs, mp_context=get_context("spawn"))
    try:
        futures = {pool.submit(_run_one, folder, effort, threads): folder for folder in folders}
        for done, future in enumerate(as_completed(futures), 1):
            folder, (error, seconds) = futures[future], future.result()
            if error:
                failures[folder] = error
            if progress:
                state = f"{'failed' if error else 'done'} after {seconds:.0f} s, {done} of {len(folders)}"
                print(f"calib: {folder.name}: {state}", file=sys.stderr, flush=True)
    finally:
        pool.shutdown(cancel_futures=True)
    return failures


def _run_one(folder: Path, effort: EffortName, workers: int) -> tuple[str, float]:
    """Why it failed, if it did, and the seconds that it took."""
    began, error = monotonic(), ""
    try:
        with working(folder, True, Options(effort, workers)) as pipeline:
            run_pipeline(pipeline)
    except Exception as problem:  # whatever it is, it is this session's and no other's
        error = str(problem) or type(problem).__name__
    return error, monotonic() - began
