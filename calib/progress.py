"""Progress: a bar on a terminal and in a notebook, elsewhere a plain line every ten seconds; with the time left."""

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, SpinnerColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as RichProgress

from calib.options import Progress

EVERY_S = 10.0
_SETTLED_S = 3.0  # a stage's first steps are slower than its others: before this no time left is told


@contextmanager
def progress_bar(quiet: bool) -> Iterator[Progress]:
    """What is going on, the share done and an estimate of the time left, on standard error or in the notebook."""
    console = Console(stderr=True)
    if quiet:
        yield lambda _message, _share: None
    elif is_kernel():
        with _in_notebook() as report:
            yield report
    elif not console.is_terminal:
        with _ticking(Lines(lambda line: print(line, file=sys.stderr, flush=True))) as lines:
            yield lines
    else:
        columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
        remaining = (TextColumn("left:"), TimeRemainingColumn())
        with RichProgress(*columns, *remaining, console=console, transient=True) as bar:
            yield Bar(bar)


class Bar:
    """Receives progress; a share that is unknown, or falls, begins a stage with its own estimate of the time left."""

    def __init__(self, bar: RichProgress) -> None:
        self._bar, self._share = bar, 0.0
        self._task = bar.add_task("starting", total=None)
        self._began = bar.tasks[0].start_time

    def __call__(self, message: str, share: float | None) -> None:
        """Shows what is going on and the share done, None when unknown."""
        if share is None or share < self._share or self._bar.tasks[0].total is None:
            self._bar.remove_task(self._task)
            self._task = self._bar.add_task(message, total=None if share is None else 1.0)
            self._bar.tasks[0].start_time = self._began
        self._share = share or 0.0
        self._bar.update(self._task, description=message, completed=self._share)


class Lines:
    """Receives progress; what takes long is reported as it begins, and then every ten seconds with the time left."""

    def __init__(
        self, write: Callable[[str], None], every_s: float = EVERY_S, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._write, self._every_s, self._clock = write, every_s, clock
        self._began = self._last = clock()
        self._from, self._share, self._long = 0.0, 0.0, False
        self._message, self._done, self._ends = "starting", "", 0.0

    def __call__(self, message: str, share: float | None) -> None:
        """Takes in what is going on, and writes a line where one is due."""
        now, first = self._clock(), share is not None and not self._long
        if share is None or share < self._share:
            self._began, self._from = now, share or 0.0
        self._share, self._message, self._done = share or 0.0, message, ""
        if share is not None and share > self._from:
            self._done = f", {share:.0%} done"
            spent = now - self._began
            self._ends = now + (1 - share) * spent / (share - self._from) if spent >= _SETTLED_S else now
        if first or now - self._last >= self._every_s:
            self._long = self._long or first
            self._show(now)

    def tick(self) -> None:
        """Writes a line where one is due although nothing new was reported."""
        now = self._clock()
        if now - self._last >= self._every_s:
            self._show(now)

    def _show(self, now: float) -> None:
        self._last = now
        remaining_s = self._ends - now if self._done else 0.0
        remaining = f"{remaining_s:.0f} s" if remaining_s < 90 else f"{remaining_s / 60:.0f} min"
        self._write(f"calib: {self._message}{self._done}{f', about {remaining} left' if remaining_s >= 0.5 else ''}")


@contextmanager
def _ticking(lines: Lines) -> Iterator[Lines]:
    """Lines are also written while one step takes long."""
    ended = threading.Event()

    def tick() -> None:
        while not ended.wait(1.0):
            lines.tick()

    clock = threading.Thread(target=tick, daemon=True)
    clock.start()
    try:
        yield lines
    finally:
        ended.set()
        clock.join()


def is_kernel() -> bool:
    """Whether this process is the kernel of a notebook; others may have loaded the module, too."""
    if "ipykernel" not in sys.modules:
        return False
    from IPython.core.getipython import get_ipython

    return getattr(get_ipython(), "kernel", None) is not None


@contextmanager
def _in_notebook() -> Iterator[Progress]:
    """One line below the cell, which goes away at the end."""
    from IPython.display import HTML, display

    handle = display(HTML(""), display_id=True)
    lines = Lines(lambda line: handle.update(HTML(f"<small>{line}</small>")), every_s=0.5)
    try:
        yield lines
    finally:
        handle.update(HTML(""))
