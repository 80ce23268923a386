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
"""The exit code after Ctrl-C, 128 + SIGINT, as shells and typer have it."""


class Clock(NamedTuple):
    """The source of time, seconds on a clock that never steps; tests use a virtual one."""

    now: Callable[[], float] = time.monotonic
    sleep: Callable[[float], None] = time.sleep


class Signals:
    """A recorder of the signals that ask the program to end, within a ``with`` block.

    They are checked between two exchanges with the motor (`raise_if_any`) instead of breaking into one, so that neither
    an exchange nor the stop is ever cut in the middle, however often Ctrl-C is pressed.
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
        """Raise `Interrupted` if a signal came."""
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
    """Handle characters that a terminal's encoding does not have: use another spelling, or the number of each."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    missing = error.object[error.start : error.end]
    return "".join(_IN_ASCII.get(each) or ascii(each)[1:-1] for each in missing), error.end


def print_in_any_encoding() -> None:
    """Spell output in what the encoding of a terminal or file has, so that it no longer ends the program."""
    codecs.register_error("in_ascii", _in_ascii)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="in_ascii")


def let_go_of_a_lost_terminal() -> None:
    """Redirect what Python still holds for a lost terminal, so that it does not end with exit code 120."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
