"""Batches: many sessions spread over workers, and the sweep of one command over them.

`spread` does pieces of work in parallel: each in a process of its own here, or as the tasks of a dask cluster. A
process that dies costs its own piece only.

`run_all` runs several sessions; a broken one stops no other.
"""

from __future__ import annotations

import pickle
import platform
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures import as_completed as as_completed_here
from contextlib import contextmanager, suppress
from functools import partial
from os import cpu_count
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from calib.kept_output import keep_output
from calib.options import EffortName, LastStepName, Options
from calib.pipeline import Pipeline, working
from calib.results.made import fit_result
from calib.results.result import Export
from reports.index import IndexEntry, write_index
from swimcal.errors import Fault, InputError, NotConverged, SwimcalError
from swimcal.results import program_version
from swimcal.runs import ENGINE, workers_of
from swimcal.session import Session

if TYPE_CHECKING:
    from distributed import Client

_PATIENCE_S = 10.0  # time to wait for a scheduler
_DIED = "its process died (killed, or out of memory?); the same command goes on from there"
_CHILD = """
import os, pickle, sys
answer = os.fdopen(os.dup(1), "wb")
os.dup2(2, 1)
sys.path[:] = pickle.load(sys.stdin.buffer)
work, piece = pickle.load(sys.stdin.buffer)
pickle.dump(work(piece), answer)
"""

Work = Callable[[Pipeline], object]


Piece = TypeVar("Piece")
Outcome = TypeVar("Outcome")


def _versions() -> tuple[str, str]:
    """Return what a worker must have in common with this process, for the same results to the last digit."""
    return program_version(), ENGINE


def spread(
    work: Callable[[Piece], Outcome],
    pieces: Sequence[Piece],
    lost: Callable[[Piece, str], Outcome],
    jobs: int = 1,
    scheduler: str | None = None,
) -> Iterator[Outcome]:
    """Yield outcomes as they come, in any order.

    Args:
        work: done on each piece; it can be pickled and raises nothing.
        pieces: the pieces of work.
        lost: makes the outcome of a piece whose process died, from the piece and the reason.
        jobs: number of pieces done at a time.
        scheduler: address of a dask scheduler, whose workers do the work; they need to see the same files. What a
            worker that dies leaves is done by others.

    Raises:
        InputError: no scheduler answers, it has no workers, or some of another version.
    """
    if scheduler is not None:
        yield from _run_elsewhere(work, pieces, lost, scheduler)
        return
    threads = ThreadPoolExecutor(jobs)
    try:
        futures = {threads.submit(_run_alone, work, piece): piece for piece in pieces}
        for future in as_completed_here(futures):
            try:
                yield future.result()
            except subprocess.CalledProcessError:
                yield lost(futures[future], _DIED)
    finally:
        threads.shutdown(cancel_futures=True)


def _run_alone(work: Callable[[Piece], Outcome], piece: Piece) -> Outcome:
    """Do a piece in a process that, unlike one of `multiprocessing`, does not run the user's script again."""
    with _in_own_process(work, piece) as outcome:
        return outcome()


@contextmanager
def _in_own_process(
    work: Callable[[Piece], Outcome], piece: Piece, interrupted: bool = True
) -> Iterator[Callable[[], Outcome]]:
    """Do a piece in a process of its own during the block, which takes the outcome; left without it, it is ended.

    Args:
        work: done on the piece; it can be pickled.
        piece: the piece of work.
        interrupted: whether a Ctrl-C on the terminal reaches that process, too.
    """
    child, group = (sys.executable, "-c", _CHILD), None if interrupted else 0
    with subprocess.Popen(child, stdin=subprocess.PIPE, stdout=subprocess.PIPE, process_group=group) as process:
        assert process.stdin is not None
        try:
            with suppress(BrokenPipeError):  # it died before it could read, which its outcome tells
                process.stdin.write(pickle.dumps(sys.path) + pickle.dumps((work, piece)))
                process.stdin.close()
            yield partial(_take_outcome, process)
        finally:
            process.kill()


def _take_outcome(process: subprocess.Popen[bytes]) -> Any:
    """Wait for what a process of `_in_own_process` answers.

    Raises:
        CalledProcessError: it died.
    """
    assert process.stdout is not None
    answer = process.stdout.read()
    if process.wait() != 0:
        raise subprocess.CalledProcessError(process.returncode, process.args)
    return pickle.loads(answer)


def _run_elsewhere(
    work: Callable[[Piece], Outcome], pieces: Sequence[Piece], lost: Callable[[Piece, str], Outcome], scheduler: str
) -> Iterator[Outcome]:
    from distributed import KilledWorker, as_completed

    with _connect(scheduler) as client:
        _check_workers(client, scheduler)
        futures = client.map(partial(_run_if_alike, work, lost, _versions()), pieces, pure=False)
        of = {future.key: piece for future, piece in zip(futures, pieces, strict=True)}
        for future in as_completed(futures):
            try:
                yield future.result()
            except KilledWorker:
                yield lost(of[future.key], _DIED)


def _run_if_alike(
    work: Callable[[Piece], Outcome], lost: Callable[[Piece, str], Outcome], wanted: tuple[str, str], piece: Piece
) -> Outcome:
    """Do a piece if the versions agree: a worker may have joined after all were checked."""
    found = _versions()
    if found != wanted:
        return lost(piece, f"worker {platform.node()} has {', '.join(found)}; expected: {', '.join(wanted)}")
    return work(piece)


def _connect(scheduler: str) -> Client:
    try:
        from distributed import Client
    except ImportError as error:
        step = "pip install 'swimcal[cluster]'"
        fault = Fault("--scheduler", "", "dask is not installed", "", "the extra `cluster`", (), step)
        raise InputError([fault]) from error
    try:
        return Client(scheduler, timeout=_PATIENCE_S)
    except (OSError, ValueError) as error:
        expected = "the address of a running dask scheduler, such as tcp://127.0.0.1:8786"
        step = "Start `dask scheduler` and some `dask worker ADDRESS`, or leave the option out."
        found = f"{scheduler!r} ({error})"
        fault = Fault("--scheduler", "", "no scheduler answers there", found, expected, next_step=step)
        raise InputError([fault]) from error


def _check_workers(client: Client, scheduler: str) -> None:
    wanted, faults = _versions(), []
    found = client.run(_versions, on_error="return")
    for worker, versions in sorted(found.items()):
        if versions != wanted:
            told = ", ".join(versions) if isinstance(versions, tuple) else f"no swimcal ({versions})"
            expected, step = ", ".join(wanted), "Install the same version there, or stop this worker."
            faults.append(Fault("--scheduler", worker, "the worker is another version", told, expected, (), step))
    if not found:
        step = f"Start some: `dask worker {scheduler}`."
        faults.append(Fault("--scheduler", "", "no workers", scheduler, "one or more", (), step))
    if faults:
        raise InputError(faults)


def run_pipeline(pipeline: Pipeline, until: LastStepName = "diagnosis") -> None:
    """Make all results that the data allow, up to a last step; with quick effort only those that are not current.

    The posterior and the diagnosis need nothing of each other: on several cores they are made at the same time.
    """
    if pipeline.only_dry:
        pipeline.structured()
        return
    pipeline.fit()
    full = pipeline.fits.effort == "full"
    sampled = until != "fit" and (full or pipeline.current_posterior(pipeline.the_fit()) is None)
    diagnosed = until == "diagnosis" and (full or pipeline.current_diagnosis() is None)
    if sampled and diagnosed and (workers_of(pipeline.options.workers) or cpu_count()) != 1:
        _sample_while_diagnosing(pipeline)
    else:
        if sampled:
            _sample(pipeline)
        if diagnosed:
            pipeline.diagnosis()
    pipeline.report()


def _sample(pipeline: Pipeline) -> None:
    try:
        pipeline.posterior()
    except NotConverged as refusal:  # a note suffices: the other results do not need the posterior
        pipeline.notes.append(f"! {refusal}")


def _sample_while_diagnosing(pipeline: Pipeline) -> None:
    """Sample the posterior in a process of its own, and diagnose here; if that process dies, sample here afterwards."""
    options = pipeline.options
    work = partial(_sample_alone, effort=options.effort, workers=options.workers)
    with _in_own_process(work, pipeline.session, interrupted=False) as sampled:
        pipeline.diagnosis()
        pipeline.job.progress("sampling the posterior", None)
        try:
            made, notes, error = sampled()
        except subprocess.CalledProcessError:
            _sample(pipeline)
            return
    pipeline.made.extend(made)
    pipeline.notes.extend(note for note in notes if note not in pipeline.notes)
    if error is not None:
        raise error


def _sample_alone(
    session: Session, effort: EffortName | None, workers: int
) -> tuple[list[Path], list[str], SwimcalError | None]:
    """Sample the posterior of a session whose lock the caller holds.

    Args:
        session: the session.
        effort: as for `Options`.
        workers: as for `Options`.

    Returns:
        The files made, notes for the user, and the error that ended the work; None where it was done.
    """
    pipeline, error = Pipeline(session, Options(effort, workers)), None
    try:
        _sample(pipeline)
    except SwimcalError as problem:
        error = problem
    return pipeline.made, pipeline.notes, error


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


def index_sessions(folders: Sequence[Path], index: str | Path | None, failures: Mapping[Path, str]) -> Export:
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
                entry, note = report_session(folder)
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


def report_session(folder: Path) -> tuple[IndexEntry, str]:
    """Bring the report of a session up to date; return its entry in the index, and what the report shows."""
    with working(folder, True) as pipeline:
        page, fit, diagnosis = pipeline.report(), fit_result(pipeline), pipeline.current_diagnosis()
        keep_output(pipeline)
    gap, effort = None if diagnosis is None else diagnosis.read(), pipeline.the_fit().effort
    name, caveats, explained = pipeline.session.name, fit.answers.caveats, len(fit.answers.explained)
    entry = IndexEntry(
        name, page, fit.data, effort, fit.verdict, gap, folder=folder, caveats=caveats, explained=explained
    )
    notes = [note if note.endswith(".") else f"{note}." for note in pipeline.notes]
    return entry, " ".join([f"{folder.name}: {pipeline.standing}; {fit.in_brief}.", *notes])


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
