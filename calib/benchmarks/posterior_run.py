"""Scores the sessions that are missing, here one after the other or on the workers of a scheduler."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import NamedTuple

from distributed import Client, as_completed

from calib.benchmarks.posterior import PosteriorScore, score_session
from calib.benchmarks.posterior_effects import Effect
from calib.benchmarks.posterior_store import ScoreStore
from session import FaultCollector, SwimcalError

Tell = Callable[[str, float | None], None]
_PATIENCE_S = 10.0


class Failure(NamedTuple):
    """A session that gave no posterior, and why."""

    seed: int
    message: str


def run_sessions(
    store: ScoreStore, seeds: Sequence[int], workers: int = 0, scheduler: str | None = None, tell: Tell | None = None
) -> tuple[Failure, ...]:
    """Scores what the store has not; each score is kept as it comes, so that a run that broke off goes on.

    Args:
        store: for the scores.
        seeds: of the sessions.
        workers: threads of each session; 0 for all cores.
        scheduler: address of a dask scheduler whose workers score them; None for one after the other in this process.
        tell: of the progress.

    Returns:
        What failed; the next run tries it again.

    Raises:
        InputError: no scheduler answers there.
        ResultsNotWritable: the folder of the store is not writable.
    """
    todo, failures = store.missing(seeds), []
    attempt = partial(_attempt, store.effect, workers)
    done = map(attempt, todo) if scheduler is None else _distributed(attempt, todo, scheduler)
    for number, outcome in enumerate(done):
        if isinstance(outcome, Failure):
            failures.append(outcome)
        else:
            store.keep(outcome)
        if tell is not None:
            tell(f"session {outcome.seed}", (number + 1) / len(todo))
    return tuple(failures)


def _attempt(effect: Effect, workers: int, seed: int) -> PosteriorScore | Failure:
    try:
        return score_session(seed, effect, workers)
    except (SwimcalError, ValueError, ArithmeticError) as error:
        return Failure(seed, f"{type(error).__name__}: {error}")


def _distributed(
    attempt: Callable[[int], PosteriorScore | Failure], seeds: Sequence[int], scheduler: str
) -> Iterator[PosteriorScore | Failure]:
    with _client(scheduler) as client:
        for future in as_completed(client.map(attempt, seeds, pure=False)):
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
