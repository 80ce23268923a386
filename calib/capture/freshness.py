"""Whether it is known when an answer was measured, told by the motor's own clock."""

import math

from calib.capture import registers
from calib.capture.registers import Unwrapped

TICK_S = 0.001
SLOW_S = 0.01  # longer than the shortest exchange, and the time is unsure by half of it
DRIFT = 0.02  # how far the two clocks may run apart, s/s


class Freshness:
    """Finds answers to earlier questions: the motor's clock is then behind.

    A reading is taken somewhere between question and answer, so that motor clock minus host clock, taken halfway,
    is right within half of what the exchange took. One that is further behind than that explains is stale; one that
    took long is fresh, but nobody knows when it was taken.
    """

    def __init__(self) -> None:
        self._tick = Unwrapped(registers.TICKS)
        self._reference: tuple[float, float, float] | None = None
        self._shortest_s = math.inf

    def is_fresh(self, tick: int, time_s: float, took_s: float) -> bool:
        """Judges a reading: its tick, the host's time halfway, and how long the exchange took."""
        self._shortest_s = min(self._shortest_s, took_s)
        off_s = self._tick.follow(tick) * TICK_S - time_s
        if self._reference is not None:
            last_off_s, last_s, last_took_s = self._reference
            allowed_s = 2 * TICK_S + (took_s + last_took_s) / 2 + DRIFT * (time_s - last_s)
            if off_s < last_off_s - allowed_s:
                return False
        self._reference = (off_s, time_s, took_s)
        return took_s <= self._shortest_s + SLOW_S
