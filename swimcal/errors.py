"""Errors with one message for a user.

The tree of errors:

    SwimcalError                 anything the user can mend; the command ends with `exit_code`
    ├── InputError               faults in files that were read, all of them at once
    ├── SessionLocked            another run works on the same session
    ├── ResultsNotWritable       a result could not be written; nothing half-written is left
    ├── ModelMismatch            a calibration made with another engine or another model
    ├── SimulationDiverged       the twin left the range in which its numbers mean something
    ├── NotEnoughData            the recordings cannot carry the estimate that was asked for
    └── NotConverged             an estimate that must not be relied on, and therefore was not reported

Readers collect every `Fault` of a file in a `FaultCollector` and raise one `InputError`.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from difflib import get_close_matches
from itertools import groupby

SHOWN_PER_KIND = 10
"""Number of faults of one kind that are spelled out; the rest is only counted."""


@dataclass(frozen=True)
class Fault:
    """One thing that is wrong with one place of one file.

    Attributes:
        file: the file as the user knows it.
        where: the place in it: ``"line 12"``, ``"line 12, trial[2].role"``; empty for the whole file.
        what: what is wrong, without a full stop.
        found: what is there; empty if nothing is.
        expected: what would have been right.
        choices: the valid values, where they can be listed.
        next_step: what to do about it, where that is not obvious from `expected`.
    """

    file: str
    where: str
    what: str
    found: str = ""
    expected: str = ""
    choices: tuple[str, ...] = ()
    next_step: str = ""

    def describe(self) -> str:
        """Describe the fault in one line, without the name of the file."""
        details = [f"found {self.found}"] if self.found else []
        details += [f"expected {self.expected}"] if self.expected else []
        details += [f"choices: {', '.join(self.choices)}"] if self.choices else []
        head = f"{self.where}: {self.what}" if self.where else self.what
        sentence = "; ".join([head, *details])
        return f"{sentence}. {self.next_step}" if self.next_step else sentence

    def __str__(self) -> str:
        return f"{self.file}: {self.describe()}"


class SwimcalError(Exception):
    """Base of every error that the user can mend; its text is complete without a traceback.

    Example:
        >>> for folder in ("pool", "nowhere"):
        ...     try:
        ...         print(calib.report(folder).file.name)
        ...     except calib.SwimcalError as error:
        ...         print(error)
        report.html
        nowhere: no session.toml here; expected a session folder with a session.toml. Make one with `calib new`.
    """

    exit_code = 2


class InputError(SwimcalError):
    """The faults in what was read, all of them at once, grouped by file.

    Attributes:
        faults: every fault found, each once.

    Example:
        >>> try:
        ...     calib.convert_tracks("tracks.csv", "tracks.nc.gz", "movement", fps=0)
        ... except calib.InputError as error:
        ...     print(error)
        the options: 2 faults
          1. --fps: not a frame rate; found 0; expected a number above 0
          2. --out: packed files are read, not written; found tracks.nc.gz; expected a name without .gz
    """

    def __init__(self, faults: Iterable[Fault]) -> None:
        self.faults: tuple[Fault, ...] = tuple(dict.fromkeys(faults))
        super().__init__(self.faults)

    def __str__(self) -> str:
        by_file = groupby(sorted(self.faults, key=lambda fault: fault.file), key=lambda fault: fault.file)
        return "\n".join(_paragraph(file, list(faults)) for file, faults in by_file)


def _paragraph(file: str, faults: Sequence[Fault]) -> str:
    if len(faults) == 1:
        return f"{file}: {faults[0].describe()}"
    ordered = sorted(faults, key=_line)
    lines = [f"  {number}. {fault.describe()}" for number, fault in enumerate(ordered, start=1)]
    return "\n".join([f"{file}: {len(faults)} faults", *lines])


def _line(fault: Fault) -> int:
    """Return the number of the line that a fault is on; faults without one come last, in the order they were found."""
    line = re.match(r"line (\d+)", fault.where)
    return int(line[1]) if line else sys.maxsize


class SessionLocked(SwimcalError):
    """The session is locked by another run.

    Example:
        >>> from swimcal.stage import session_lock
        >>> try:
        ...     with session_lock(calib.open_session("pool").folder):   # as another run does
        ...         calib.fit("pool", "quick", progress=False)
        ... except calib.SessionLocked as error:
        ...     print(error)
        pool: this session is being worked on; found: its lock held by process ... Wait for that run, or end it; ...
    """


class ResultsNotWritable(SwimcalError):
    """A result could not be written; what was there before is unchanged.

    Example:
        >>> try:
        ...     calib.export_mjcf(out="pool")
        ... except calib.ResultsNotWritable as error:
        ...     print(error)
        pool: cannot be written; found: a folder; expected: the name of a file.
    """


class ModelMismatch(SwimcalError):
    """A calibration made with another engine or another model than the one in use.

    Example:
        >>> from swimgym import load_fish
        >>> try:
        ...     load_fish("old")                                # fitted with MuJoCo 3.9
        ... except calib.ModelMismatch as error:
        ...     print(error)
        old/results/calibration.json: this calibration was made with MuJoCo 3.9.0, here is 4... Fit again with ...
    """


class SimulationDiverged(SwimcalError):
    """The simulation became unstable; its numbers must not be used.

    Example:
        >>> try:
        ...     calib.load_twin().swim(12.0)
        ... except calib.SimulationDiverged as error:
        ...     print(error)
        1 of 1 simulations diverged; the first at coefficients [0.4, 7.79, 2.81, 3.84, 0.27], 12 Hz. Expected ...
    """


class NotEnoughData(SwimcalError):
    """The recordings cannot carry the estimate that was asked for.

    Example:
        >>> try:
        ...     calib.view("filmed")
        ... except calib.NotEnoughData as error:
        ...     print(error)
        filmed: nothing to show. Expected tracks; found videos that are not tracked: run `calib track filmed`.
    """


class NotConverged(SwimcalError):
    """An estimate that must not be relied on; it was not reported.

    Example:
        >>> try:
        ...     calib.posterior("short", "quick", progress=False)
        ... except calib.NotConverged as error:
        ...     print(error)
        short/results/posterior.nc: not written, nor are intervals reported; found: ... or try another [fit] seed ...
    """


class FaultCollector:
    """A collector of faults that raises them together.

    >>> faults = FaultCollector("robot.toml")
    >>> faults.add("line 3, water.density_kg_m3", "not a density", found="-1", expected="a number above 0")
    >>> with faults.nested():          # takes over the faults of an InputError raised inside
    ...     load_tracks(path, markers, fps)
    >>> faults.raise_if_any()
    """

    def __init__(self, file: str = "") -> None:
        self.file = file
        self.faults: list[Fault] = []

    def __bool__(self) -> bool:
        return bool(self.faults)

    def add(
        self,
        where: str,
        what: str,
        *,
        found: str = "",
        expected: str = "",
        choices: Iterable[str] = (),
        next_step: str = "",
    ) -> None:
        """Add a fault of this collector's file; the arguments are the fields of `Fault`."""
        self.faults.append(Fault(self.file, where, what, found, expected, tuple(choices), next_step))

    def extend(self, faults: Iterable[Fault]) -> None:
        """Add faults, whatever their file."""
        self.faults.extend(faults)

    def extend_capped(self, faults: Sequence[Fault]) -> None:
        """Add the first faults of one kind, and one that counts the others."""
        self.faults.extend(faults[:SHOWN_PER_KIND])
        if (rest := len(faults) - SHOWN_PER_KIND) > 0:
            last = faults[-1]
            more = f"and {rest} more like the last"
            more += f", up to {last.where}" if last.where != faults[SHOWN_PER_KIND - 1].where else ""
            self.faults.append(Fault(last.file, "", more, "", ""))

    @contextmanager
    def nested(self) -> Iterator[None]:
        """Take over the faults of an `InputError` raised in the block, which then ends quietly."""
        try:
            yield
        except InputError as error:
            self.extend(error.faults)

    def raise_if_any(self) -> None:
        """Raise one `InputError` with every fault gathered.

        Raises:
            InputError: if there is any.
        """
        if self.faults:
            raise InputError(self.faults)


def did_you_mean(word: str, choices: Iterable[str]) -> str:
    """Suggest the closest choice as a next step; empty when none is close."""
    close = get_close_matches(word, list(choices), n=1)
    return f"Did you mean {close[0]!r}?" if close else ""


def shown(value: object, width: int = 60) -> str:
    """Format a value as an error message shows it: its repr, shortened to `width` characters."""
    text = repr(value)
    return text if len(text) <= width else f"{text[: width - 1]}…"
