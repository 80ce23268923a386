"""The line of a terminal that shows speed, current and temperature of the motor while it is driven.

It has a thread of its own: a terminal that takes nothing more (after Ctrl-S, over a slow line) must not keep the loop
that drives the motor from its beat.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TextIO

from calib.capture import registers
from calib.capture.motor import Reading

EVERY_S = 0.25
PATIENCE_S = 0.5
"""Time that a terminal gets to take what is written, before the program goes on without."""
_CLEAR = "\r\x1b[K"

Live = Callable[[str, float, Reading], None]
"""Function that takes the name of a trial, the host's time at which it ends, and what the motor measures."""


def show_nothing(_trial: str, _end_s: float, _reading: Reading) -> None:
    """Show no line."""


def describe(trial: str, end_s: float, reading: Reading) -> str:
    """Describe a reading: `f0_60: 0.600 turns/s, 0.42 A, 34 degrees C, 18 s left`."""
    measured = reading.measured
    speed = f"{registers.turns_per_s(measured.velocity):.3f} turns/s"
    current = f"{abs(measured.current) * registers.AMPERE:.2f} A"
    return (
        f"{trial}: {speed}, {current}, {measured.temperature} degrees C, {max(0.0, end_s - reading.time_s):.0f} s left"
    )


class LiveLine:
    """A line that is written again and again with the newest reading.

    Args:
        write: writes text to the terminal; it may block.
        columns: width of the terminal.
    """

    def __init__(self, write: Callable[[str], object], columns: int = 80) -> None:
        self._write, self._columns = write, columns
        self._newest: tuple[str, float, Reading] | None = None
        self._writing, self._ended = threading.Lock(), threading.Event()
        self._thread = threading.Thread(target=self._repeat, name="live line", daemon=True)
        self._thread.start()

    def __call__(self, trial: str, end_s: float, reading: Reading) -> None:
        """Take the newest reading; this only keeps it."""
        self._newest = trial, end_s, reading

    def clear(self) -> None:
        """Take the line away, so that another can be printed in its place."""
        shown, self._newest = self._newest, None
        if shown and self._writing.acquire(timeout=PATIENCE_S):
            with contextlib.suppress(OSError, ValueError):
                self._write(_CLEAR)
            self._writing.release()

    def end(self) -> None:
        """Take the line away for good."""
        self.clear()
        self._ended.set()
        self._thread.join(PATIENCE_S)

    def _repeat(self) -> None:
        while not self._ended.wait(EVERY_S):
            with self._writing, contextlib.suppress(OSError, ValueError):
                if (newest := self._newest) is not None:
                    self._write(f"{_CLEAR}{describe(*newest)[: self._columns - 1]}")


@contextmanager
def live_line(terminal: TextIO | None) -> Iterator[LiveLine | None]:
    """Show a line on a terminal within the block; nothing where the file is none, for example a log."""
    try:
        shown = terminal is not None and terminal.isatty()
        number = terminal.fileno() if terminal is not None and shown else -1
    except (OSError, ValueError):
        shown = False
    if not shown:
        yield None
        return
    line = LiveLine(lambda text: os.write(number, text.encode()), shutil.get_terminal_size().columns)
    try:
        yield line
    finally:
        line.end()
