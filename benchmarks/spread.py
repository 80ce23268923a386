"""Independent pieces of work side by side: in processes here, or on the workers of a dask scheduler."""

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures import as_completed as as_completed_here
from multiprocessing import get_context
from typing import TypeVar

from distributed import Client, as_completed

from session import FaultCollector

_PATIENCE_S = 10.0
Piece = TypeVar("Piece")
Outcome = TypeVar("Outcome")


def spread(
    work: Callable[[Piece], Outcome], pieces: Sequence[Piece], workers: int = 0, scheduler: str | None = None
) -> Iterator[Outcome]:
    """Outcomes as they come, in any order. One thread a piece: two pieces at once take less than one after the other.

    Args:
        work: can be pickled, as can pieces and outcomes; with one worker it runs in this process.
        pieces: of work.
        workers: processes; 0 for one on each core.
        scheduler: address of a dask scheduler whose workers do it instead; what one leaves that dies is done again.

    Raises:
        InputError: no scheduler answers there.
    """
    if scheduler is not None:
        return _distributed(work, pieces, scheduler)
    processes = min(workers or os.cpu_count() or 1, len(pieces))
    return map(work, pieces) if processes <= 1 else _in_processes(work, pieces, processes)


def _in_processes(work: Callable[[Piece], Outcome], pieces: Sequence[Piece], processes: int) -> Iterator[Outcome]:
    pool = ProcessPoolExecutor(processes, mp_context=get_context("spawn"))
    try:
        for future in as_completed_here([pool.submit(work, piece) for piece in pieces]):
            yield future.result()
    finally:
        pool.shutdown(cancel_futures=True)


def _distributed(work: Callable[[Piece], Outcome], pieces: Sequence[Piece], scheduler: str) -> Iterator[Outcome]:
    with _client(scheduler) as client:
        for future in as_completed(client.map(work, pieces, pure=False)):
            yield future.result()


def _client(scheduler: str) -> Client:
    try:
        return Client(scheduler, timeout=_PATIENCE_S)
    except (OSError, ValueError) as error:
        faults = FaultCollector("--scheduler")
        faults.add(
            "",
            "no scheduler answers there",
            found=f"{scheduler!r} ({error})",
            expected="the address of a running dask scheduler, such as tcp://127.0.0.1:8786",
            next_step="Start `dask scheduler` and some `dask worker ADDRESS`, or leave the option out.",
        )
        faults.raise_if_any()
        raise
