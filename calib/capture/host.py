"""The time, the signals and the terminal of the computer that drives the motor."""

from __future__ import annotations

import codecs
import io
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from types import FrameType
from typing import Any, NamedTuple

from calib.capture.errors import Interrupted

INTERRUPTED = 130
"""The exit code after Ctrl-C, 128 + SIGINT as shells have it; what typer makes of it too."""


class Clock(NamedTuple):
    """Where time comes from, seconds on a clock that never steps; tests put a virtual one here."""

    now: Callable[[], float] = time.monotonic
    sleep: Callable[[float], None] = time.sleep


class Signals:
    """Notes the signals that ask the program to end, within a ``with`` block.

    They are looked at between two exchanges with the motor (`raise_if_any`) instead of breaking into one, so that
    neither an exchange nor the stop is ever cut in the middle, however often Ctrl-C is pressed.
    """

    WATCHED = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))

    def __init__(self) -> None:
        self.caught: int | None = None
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Signals:
        if threading.current_thread() is threading.main_thread():
            self._before = {number: signal.signal(number, self._note) for number in self.WATCHED}
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def raise_if_any(self) -> None:
        """Raises `Interrupted` if a signal came."""
        if self.caught is not None:
            raise Interrupted(self.caught)

    def _note(self, number: int, _frame: FrameType | None) -> None:
        if self.caught is None:
            self.caught = number


_IN_ASCII = {
    "\N{MINUS SIGN}": "-",
    "\N{EN DASH}": "-",
    "\N{PLUS-MINUS SIGN}": "+/-",
    "\N{MULTIPLICATION SIGN}": "x",
    "\N{HORIZONTAL ELLIPSIS}": "...",
    "\N{RIGHTWARDS ARROW}": "->",
    "\N{GREEK SMALL LETTER BETA}": "beta",
}


def _in_ascii(error: UnicodeError) -> tuple[str, int]:
    """The handler of characters that a terminal's encoding does not have: another spelling, or the number of each."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    missing = error.object[error.start : error.end]
    return "".join(_IN_ASCII.get(each) or ascii(each)[1:-1] for each in missing), error.end


def print_in_any_encoding() -> None:
    """Output to a terminal or file that is not UTF-8 is spelled in what it has, and no longer ends the program."""
    codecs.register_error("in_ascii", _in_ascii)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="in_ascii")


def let_go_of_a_lost_terminal() -> None:
    """Python ends with 120, whatever happened, where it cannot write what it still holds for a lost terminal."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
