"""A clock that runs only when told to."""

from __future__ import annotations


class VirtualClock:
    """Call it for the time in s; `sleep` moves it on at once. It starts at `start_s`."""

    def __init__(self, start_s: float = 0.0) -> None:
        self._now = start_s

    def __call__(self) -> float:
        """The time in s."""
        return self._now

    def sleep(self, seconds: float) -> None:
        """Moves the time on; a negative time counts as none."""
        self._now += max(0.0, seconds)
