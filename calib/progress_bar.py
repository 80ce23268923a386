"""The progress of a command with the time left: a bar on a terminal and in a notebook, elsewhere lines now and then."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, ProgressColumn, SpinnerColumn, Task, TextColumn, TimeElapsedColumn
from rich.progress import Progress as RichProgress
from rich.table import Column
from rich.text import Text

from fitting.progress import Progress

EVERY_S = 10.0
_SETTLED_S = 3.0  # no time left is shown before this, because a stage's first steps are slower than the others
_NEWS = 0.3  # smallest relative change of the time left that is worth a line


@contextmanager
def progress_bar(quiet: bool) -> Iterator[Progress]:
    """Show what is going on, the share done and the estimated time left, on standard error or in the notebook."""
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
        what = TextColumn("{task.description}", table_column=Column(ratio=1, no_wrap=True, overflow="ellipsis"))
        columns = (SpinnerColumn(), what, BarColumn(16), TimeElapsedColumn(), TimeLeft(Column(no_wrap=True)))
        with RichProgress(*columns, console=console, transient=True, expand=True) as bar:
            yield ProgressBar(bar)


class Estimate:
    """An estimate of the time left of a stage, from its share done and the time that this took.

    It grows while the share stays the same. A share that is unknown, or falls, begins a stage.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock, self._began, self._from = clock, clock(), 0.0
        self.share: float | None = None

    def update(self, share: float | None) -> None:
        """Take in the share done, None when unknown."""
        if share is None or self.share is None or share < self.share:
            self._began, self._from = self._clock(), share or 0.0
        self.share = share

    @property
    def spent_s(self) -> float:
        """Seconds since the stage began."""
        return self._clock() - self._began

    @property
    def left_s(self) -> float | None:
        """Seconds until the stage ends; None while too little is done to tell."""
        if self.share is None or self.share <= self._from or self.spent_s < _SETTLED_S:
            return None
        return (1 - self.share) * self.spent_s / (self.share - self._from)


class ProgressBar:
    """A bar that receives progress; each stage has its own estimate of the time left."""

    def __init__(self, bar: RichProgress, clock: Callable[[], float] = time.monotonic) -> None:
        self._bar, self._estimate = bar, Estimate(clock)
        self._task = bar.add_task("starting", total=None, estimate=self._estimate)

    def __call__(self, message: str, share: float | None) -> None:
        """Show what is going on and the share done, None when unknown."""
        self._estimate.update(share)
        total = None if share is None else 1.0
        self._bar.update(self._task, description=message, total=total, completed=share or 0.0)


class TimeLeft(ProgressColumn):
    """The estimate of the time left, at the end of a bar."""

    def render(self, task: Task) -> Text:
        """Render the column of one bar."""
        left_s = task.fields["estimate"].left_s
        return Text(f"left: {'–' if left_s is None else f'about {_format_duration(left_s)}'}")


class Lines:
    """A writer of progress in lines.

    A step that takes long is reported as it begins, and then, where there is news, every ten seconds. News are a new
    message, the share done, and an estimate of the time left that changed by more than 30 %. While there are none, a
    line at growing intervals says how long the step has taken.
    """

    def __init__(
        self, write: Callable[[str], None], every_s: float = EVERY_S, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._write, self._every_s, self._clock = write, every_s, clock
        self._estimate, self._message, self._long = Estimate(clock), "starting", False
        self._since = self._last = clock()
        self._told: tuple[str, str] | None = None
        self._told_left_s: float | None = None
        self._wait_s = every_s

    def __call__(self, message: str, share: float | None) -> None:
        """Take in what is going on, and write a line where one is due."""
        if message != self._message:
            self._since = self._clock()
        self._message, first = message, share is not None and not self._long
        self._estimate.update(share)
        if first:
            self._long = True
            self._show()
        else:
            self.tick()

    def tick(self) -> None:
        """Write a line where one is due although nothing new was reported."""
        waited = self._clock() - self._last
        if waited >= self._wait_s or (waited >= self._every_s and self._is_news):
            self._show()

    @property
    def _is_news(self) -> bool:
        left_s, told_s = self._estimate.left_s, self._told_left_s
        if (self._message, self._done) != self._told or (left_s is None) != (told_s is None):
            return True
        return left_s is not None and told_s is not None and abs(left_s - told_s) > _NEWS * told_s

    @property
    def _done(self) -> str:
        share = self._estimate.share
        return f", {share:.0%} done" if share and share >= 0.005 else ""

    def _show(self) -> None:
        now, left_s, same = self._clock(), self._estimate.left_s, (self._message, self._done) == self._told
        self._wait_s = 2 * self._wait_s if same else self._every_s
        self._last, self._told, self._told_left_s = now, (self._message, self._done), left_s
        taken = f", for {_format_duration(now - self._since)}" if same else ""
        left = f", about {_format_duration(left_s)} left" if left_s is not None and left_s >= 0.5 else ""
        self._write(f"calib: {self._message}{taken}{self._done}{left}")


def is_kernel() -> bool:
    """Return whether this process is the kernel of a notebook; other processes may have loaded the module, too."""
    if "ipykernel" not in sys.modules:
        return False
    from IPython.core.getipython import get_ipython

    return getattr(get_ipython(), "kernel", None) is not None


def _format_duration(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 90 else f"{seconds / 60:.{1 if seconds < 600 else 0}f} min"


@contextmanager
def _ticking(lines: Lines) -> Iterator[Lines]:
    """Let lines be written also while one step takes long."""
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


@contextmanager
def _in_notebook() -> Iterator[Progress]:
    """Show one line below the cell, which goes away at the end."""
    from IPython.display import HTML, display

    handle = display(HTML(""), display_id=True)
    lines = Lines(lambda line: handle.update(HTML(f"<small>{line}</small>")), every_s=0.5)
    try:
        yield lines
    finally:
        handle.update(HTML(""))
