"""Scores the sessions that are missing, side by side here or on the workers of a scheduler."""

from collections.abc import Callable, Sequence
from functools import partial

from benchmarks.posterior.effect_names import Effect
from benchmarks.posterior.score import PosteriorScore, score_session
from benchmarks.posterior.store import Failure, ScoreStore
from benchmarks.spread import spread
from session import SwimcalError

Tell = Callable[[str, float | None], None]


def run_sessions(
    store: ScoreStore, seeds: Sequence[int], workers: int = 0, scheduler: str | None = None, tell: Tell | None = None
) -> None:
    """Scores what the store has not; each score is kept as it comes, so that a run that broke off goes on.

    What gives no posterior is noted in the store, and the next run tries it again.

    Args:
        store: for the scores.
        seeds: of the sessions.
        workers: sessions at a time, each in a process of its own with one thread; 0 for one on each core.
        scheduler: address of a dask scheduler whose workers score them instead.
        tell: of the progress.

    Raises:
        InputError: no scheduler answers there.
        ResultsNotWritable: the folder of the store is not writable.
    """
    todo = store.missing(seeds)
    for number, outcome in enumerate(spread(partial(_attempt, store.effect, store.strength), todo, workers, scheduler)):
        if isinstance(outcome, Failure):
            store.keep_failure(outcome)
        else:
            store.keep(outcome)
        if tell is not None:
            tell(f"session {outcome.seed}", (number + 1) / len(todo))


def _attempt(effect: Effect, strength: float, seed: int) -> PosteriorScore | Failure:
    try:
        return score_session(seed, effect, strength, workers=1)
    except (SwimcalError, ValueError, ArithmeticError) as error:
        return Failure(seed, f"{type(error).__name__}: {error}")
