"""Loop of all benchmarks: it works off cases side by side; and their records, of which a file holds one or a line each.

Each case has a name. What comes of it is a record: a frozen dataclass (`swimcal.results`).
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from calib.batch import spread
from swimcal.errors import Fault, FaultCollector, InputError
from swimcal.results import from_plain, plain_json, to_plain, write_whole

Progress = Callable[[str, float | None], None]
Case = TypeVar("Case")
Record = TypeVar("Record")


class Failure(NamedTuple):
    """Case that came to nothing, and why."""

    name: str
    message: str


class Run(NamedTuple):
    """Way to work off cases."""

    workers: int = 0  # cases at a time, each in a process of its own; 0 for one on each core
    progress: Progress | None = None


def run_cases(
    work: Callable[[Case], Record],
    cases: Mapping[str, Case],
    run: Run,
    keep: Callable[[Record], None] = lambda _record: None,
) -> tuple[Failure, ...]:
    """Work off all cases; a failure in one stops no other.

    Args:
        work: makes the record of a case; it can be pickled.
        cases: cases that are still to be done, by name.
        run: way to work off the cases.
        keep: takes each record as it comes, in this process.

    Returns:
        What failed; the next run tries it again.
    """
    failures = []
    tried, named = partial(_try_case, work), list(cases.items())
    processes = min(run.workers or os.cpu_count() or 1, len(cases))
    outcomes: Iterable[Record | Failure] = map(tried, named)
    if processes > 1:
        outcomes = spread(tried, named, lambda case, why: Failure(case[0], why), processes)
    for done, outcome in enumerate(outcomes, 1):
        if isinstance(outcome, Failure):
            failures.append(outcome)
        else:
            keep(outcome)
        if run.progress is not None:
            run.progress(f"{done} of {len(cases)}", done / len(cases))
    return tuple(failures)


def _try_case(work: Callable[[Case], Record], named: tuple[str, Case]) -> Record | Failure:
    name, case = named
    try:
        return work(case)
    except Exception as error:  # whatever it is, it is this case's failure and no other's
        return Failure(name, f"{type(error).__name__}: {error}")


def write_record(path: Path, record: Any) -> None:
    """Write one record as plain JSON.

    Raises:
        ResultsNotWritable: it cannot be written.
    """
    write_whole(path, json.dumps(plain_json(to_plain(record)), indent=1) + "\n")


def write_lines(path: Path, records: Sequence[Any]) -> None:
    """Write records, a line each: files of several shards, one after the other, are a file as well.

    Raises:
        ResultsNotWritable: it cannot be written.
    """
    write_whole(path, "".join(map(_format_line, records)))


def add_line(path: Path, record: Any) -> None:
    """Add a record to a file, which a run that breaks off leaves as it is then."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a", encoding="utf-8") as file:
        file.write(_format_line(record))


def _format_line(record: Any) -> str:
    return json.dumps(plain_json(to_plain(record))) + "\n"


def read_lines(path: Path, kind: type[Record], name_of: Callable[[Record], str]) -> tuple[Record, ...]:
    """Read what `write_lines` or `add_line` wrote, whichever code made it.

    Args:
        path: the file.
        kind: class of the records.
        name_of: returns the name that identifies a record.

    Raises:
        InputError: it cannot be read, holds one case twice, or something that is no record; all faults at once.
    """
    faults, records = FaultCollector(str(path)), dict[str, Record]()
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, ValueError) as error:
        fault = Fault(str(path), "", "cannot be read", str(error), "records, one line of JSON each")
        raise InputError([fault]) from error
    if not lines:
        faults.add("", "holds no record", found="nothing", expected="a line a case", next_step="Give another file.")
    for number, line in enumerate(lines, start=1):
        try:
            record = from_plain(kind, json.loads(line))
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            faults.add(f"line {number}", "is no record", found=repr(error), expected=f"a {kind.__name__} as JSON")
            continue
        if (name := name_of(record)) in records:
            faults.add(f"line {number}", "a case is listed twice", found=name, expected="each once")
        records[name] = record
    faults.raise_if_any()
    return tuple(records.values())
