"""Scores the sessions that are missing, side by side here or on the workers of a scheduler."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

from calib.benchmarks.posterior import PosteriorScore, score_session
from calib.benchmarks.posterior_effects import Effect
from calib.benchmarks.posterior_store import ScoreStore
from calib.benchmarks.spread import spread
from session import SwimcalError

Tell = Callable[[str, float | None], None]


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
        workers: sessions at a time, each in a process of its own with one thread; 0 for one on each core.
        scheduler: address of a dask scheduler whose workers score them instead.
        tell: of the progress.

    Returns:
        What failed; the next run tries it again.

    Raises:
        InputError: no scheduler answers there.
        ResultsNotWritable: the folder of the store is not writable.
    """
    todo, failures = store.missing(seeds), []
    for number, outcome in enumerate(spread(partial(_attempt, store.effect), todo, workers, scheduler)):
        if isinstance(outcome, Failure):
            failures.append(outcome)
        else:
            store.keep(outcome)
        if tell is not None:
            tell(f"session {outcome.seed}", (number + 1) / len(todo))
    return tuple(failures)


def _attempt(effect: Effect, seed: int) -> PosteriorScore | Failure:
    try:
        return score_session(seed, effect, workers=1)
    except (SwimcalError, ValueError, ArithmeticError) as error:
        return Failure(seed, f"{type(error).__name__}: {error}")
