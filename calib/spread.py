"""Pieces of work done in parallel: each in a process of its own here, or as the tasks of a dask cluster.

A process that dies costs its own piece only.
"""

from __future__ import annotations

import pickle
import platform
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures import as_completed as as_completed_here
from functools import partial
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from session import InputError
from session.errors import Fault
from session.results import program_version
from swimmer.engine import ENGINE

if TYPE_CHECKING:
    from distributed import Client

Piece = TypeVar("Piece")
Outcome = TypeVar("Outcome")
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


class Versions(NamedTuple):
    """The versions that a worker must have in common with this process, for the same results to the last digit."""

    program: str
    engine: str

    @classmethod
    def here(cls) -> Versions:
        """Return the versions of this process."""
        return cls(program_version(), ENGINE)


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
    told = pickle.dumps(sys.path) + pickle.dumps((work, piece))
    done = subprocess.run((sys.executable, "-c", _CHILD), input=told, stdout=subprocess.PIPE, check=True)
    outcome: Outcome = pickle.loads(done.stdout)
    return outcome


def _run_elsewhere(
    work: Callable[[Piece], Outcome], pieces: Sequence[Piece], lost: Callable[[Piece, str], Outcome], scheduler: str
) -> Iterator[Outcome]:
    from distributed import KilledWorker, as_completed

    with _connect(scheduler) as client:
        _check_workers(client, scheduler)
        futures = client.map(partial(_run_if_alike, work, lost, Versions.here()), pieces, pure=False)
        of = {future.key: piece for future, piece in zip(futures, pieces, strict=True)}
        for future in as_completed(futures):
            try:
                yield future.result()
            except KilledWorker:
                yield lost(of[future.key], _DIED)


def _run_if_alike(
    work: Callable[[Piece], Outcome], lost: Callable[[Piece, str], Outcome], wanted: Versions, piece: Piece
) -> Outcome:
    """Do a piece if the versions agree: a worker may have joined after all were checked."""
    found = Versions.here()
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
    wanted, faults = Versions.here(), []
    found = client.run(Versions.here, on_error="return")
    for worker, versions in sorted(found.items()):
        if versions != wanted:
            told = ", ".join(versions) if isinstance(versions, Versions) else f"no swimcal ({versions})"
            expected, step = ", ".join(wanted), "Install the same version there, or stop this worker."
            faults.append(Fault("--scheduler", worker, "the worker is another version", told, expected, (), step))
    if not found:
        step = f"Start some: `dask worker {scheduler}`."
        faults.append(Fault("--scheduler", "", "no workers", scheduler, "one or more", (), step))
    if faults:
        raise InputError(faults)
