"""The same work for each session of a suite, spread over cores or a cluster; what fails in one stops no other."""

from collections.abc import Callable, Sequence
from typing import TypeVar

from benchmarks.effects.folder import Failure, Tell
from benchmarks.spread import spread

T = TypeVar("T")


def each_session(
    work: Callable[[T], Failure | None], todo: Sequence[T], workers: int, scheduler: str | None, tell: Tell | None
) -> tuple[Failure, ...]:
    """Does it, and gathers what failed.

    Args:
        work: of one session; it can be pickled.
        todo: what says which session.
        workers: sessions at a time; 0 for one on each core.
        scheduler: address of a dask scheduler whose workers do it; they need to see the same folder.
        tell: of the progress.

    Raises:
        InputError: no scheduler answers.
    """
    failures = []
    for number, failure in enumerate(spread(work, todo, workers, scheduler)):
        if failure is not None:
            failures.append(failure)
        if tell is not None:
            tell(f"{number + 1} of {len(todo)} sessions", (number + 1) / len(todo))
    return tuple(failures)
