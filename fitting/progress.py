"""Progress of a computation, and of a part of it on the scale of the whole."""

from collections.abc import Callable

Progress = Callable[[str, float | None], None]
"""Function that takes a message and the share of the time that is spent, None when unknown."""


def part_of(tell: Progress, start: float, end: float) -> Progress:
    """Return a progress for a part that takes the time of the whole from share `start` to share `end`.

    Args:
        tell: progress of the whole.
        start: share of the time at which the part begins.
        end: share of the time at which it ends.
    """

    def tell_whole(message: str, share: float | None) -> None:
        tell(message, None if share is None else start + (end - start) * share)

    return tell_whole
