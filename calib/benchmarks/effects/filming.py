"""Reality for many sessions at once: one of its steps takes hardly longer for a hundred trials than for eight.

Work on a session is a generator: it yields the trials that it wants to see and is sent their recordings.
"""

from collections.abc import Generator, Sequence
from typing import TypeVar

import numpy as np

from reality import Recording, Trial, World, divergence, simulate
from session import FISHSIM_MARKERS

T = TypeVar("T")
Wanted = Sequence[tuple[World, Trial]]
Filming = Generator[Wanted, list[Recording], T]


def film_together(works: Sequence[Filming[T]]) -> list[T]:
    """What pieces of work end with, in their order; whatever they want to see is simulated in common.

    A recording does not depend on its company (to some 1e-7 px). What cannot be simulated is raised within the work
    that asked for it: `SimulationDiverged`, or the `ValueError` of a trial that is impossible.
    """
    ended: dict[int, T] = {}
    waiting: dict[int, Wanted] = {}

    def go_on(number: int, sent: list[Recording] | Exception | None) -> None:
        work = works[number]
        waiting.pop(number, None)
        try:
            waiting[number] = work.throw(sent) if isinstance(sent, Exception) else work.send(sent)  # type: ignore[arg-type]
        except StopIteration as stop:
            ended[number] = stop.value

    for number in range(len(works)):
        go_on(number, None)
    while waiting:
        for number, filmed in _filmed(dict(waiting)).items():
            go_on(number, filmed)
    return [ended[number] for number in range(len(works))]


def _filmed(wanted: dict[int, Wanted]) -> dict[int, list[Recording] | Exception]:
    trials = [trial for each in wanted.values() for trial in each]
    try:
        recordings = iter(simulate(trials, FISHSIM_MARKERS, allow_divergence=True))
    except ValueError as error:
        if len(wanted) == 1:
            return dict.fromkeys(wanted, error)
        return {number: filmed for own in wanted.items() for number, filmed in _filmed(dict([own])).items()}
    of_each = {number: [next(recordings) for _ in each] for number, each in wanted.items()}
    return {number: _or_lost(own) for number, own in of_each.items()}


def _or_lost(recordings: list[Recording]) -> list[Recording] | Exception:
    lost = np.array([not np.isfinite(recording.head).all() for recording in recordings])
    return divergence([recording.trial for recording in recordings], lost) if lost.any() else recordings
