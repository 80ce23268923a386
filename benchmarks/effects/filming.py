"""The second simulator for many sessions at once: one of its steps takes hardly longer for a hundred trials than for 8.

Work on a session is a generator: it yields the trials that it wants to see and is sent their recordings.
"""

from collections.abc import Callable, Generator, Iterable, Sequence
from typing import TypeVar

import numpy as np

from benchmarks.reality import Recording, Trial, World, simulate
from benchmarks.reality.run import divergence
from swimcal.create_session import FISHSIM_MARKERS

T = TypeVar("T")
Wanted = Sequence[tuple[World, Trial]]
Filming = Generator[Wanted, list[Recording], T]
Simulate = Callable[..., list[Recording]]  # called as `benchmarks.reality.simulate` is


def film_together(works: Iterable[Filming[T]], at_once: int | None = None, by: Simulate | None = None) -> list[T]:
    """Return what pieces of work end with, in their order; simulate in common whatever they want to see.

    A recording does not depend on its company (to some 1e-7 px). What cannot be simulated is raised within the work
    that asked for it: `SimulationDiverged`, or the `ValueError` of a trial that is impossible.

    Args:
        works: pieces of work, begun as there is room for them.
        at_once: number of pieces under way, at least one; where one ends, the next begins. Default: all.
        by: function that simulates; default: the second simulator.
    """
    assert at_once is None or at_once > 0
    begun = iter(enumerate(works))
    under_way: dict[int, Filming[T]] = {}
    waiting: dict[int, Wanted] = {}
    ended: dict[int, T] = {}

    def go_on(number: int, sent: list[Recording] | Exception | None) -> None:
        work = under_way[number]
        waiting.pop(number, None)
        try:
            waiting[number] = work.throw(sent) if isinstance(sent, Exception) else work.send(sent)  # type: ignore[arg-type]
        except StopIteration as stop:
            ended[number] = stop.value
            del under_way[number]

    while True:
        while at_once is None or len(under_way) < at_once:
            if (one := next(begun, None)) is None:
                break
            number, under_way[number] = one
            go_on(number, None)
        if not waiting:
            return [ended[number] for number in sorted(ended)]
        for number, filmed in _film(dict(waiting), by or simulate).items():
            go_on(number, filmed)


def _film(wanted: dict[int, Wanted], by: Simulate) -> dict[int, list[Recording] | Exception]:
    trials = [trial for each in wanted.values() for trial in each]
    try:
        recordings = iter(by(trials, FISHSIM_MARKERS, allow_divergence=True))
    except ValueError as error:
        if len(wanted) == 1:
            return dict.fromkeys(wanted, error)
        return {number: filmed for own in wanted.items() for number, filmed in _film(dict([own]), by).items()}
    of_each = {number: [next(recordings) for _ in each] for number, each in wanted.items()}
    return {number: _check_divergence(own) for number, own in of_each.items()}


def _check_divergence(recordings: list[Recording]) -> list[Recording] | Exception:
    lost = np.array([not np.isfinite(recording.head).all() for recording in recordings])
    return divergence([recording.trial for recording in recordings], lost) if lost.any() else recordings
