"""Loop of all benchmarks: it works off cases side by side, and does not repeat what is done.

Each case has a name. What comes of it is a record: a frozen dataclass (`swimcal.results`), kept as a file of its own,
so that several machines may fill one folder, or as a line of a file with many.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

from calib.batch import spread
from swimcal.errors import Fault, FaultCollector, InputError
from swimcal.results import from_plain, plain_json, sha256_of, to_plain, write_whole
from swimcal.stage import fingerprint_of

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
    scheduler: str | None = None  # address of a dask scheduler whose workers do it instead
    progress: Progress | None = None


def run_cases(
    work: Callable[[Case], Record],
    cases: Mapping[str, Case],
    run: Run,
    keep: Callable[[str, Record], None] = lambda _name, _record: None,
) -> tuple[Failure, ...]:
    """Work off all cases; a failure in one stops no other.

    Args:
        work: makes the record of a case; it can be pickled. Where it writes files, workers elsewhere need to see the
            same folder.
        cases: cases that are still to be done, by name.
        run: way to work off the cases.
        keep: takes each name and record as it comes, in this process.

    Returns:
        What failed; the next run tries it again.

    Raises:
        InputError: no scheduler answers.
    """
    failures = []
    tried, named = partial(_try_case, work), list(cases.items())
    processes = min(run.workers or os.cpu_count() or 1, len(cases))
    if processes <= 1 and run.scheduler is None:
        outcomes: Iterable[tuple[str, Record | Failure]] = map(tried, named)
    else:
        outcomes = spread(tried, named, _report_lost, processes, run.scheduler)
    for done, (name, outcome) in enumerate(outcomes, 1):
        if isinstance(outcome, Failure):
            failures.append(outcome)
        else:
            keep(name, outcome)
        if run.progress is not None:
            run.progress(f"{done} of {len(cases)}", done / len(cases))
    return tuple(failures)


def _report_lost(named: tuple[str, Case], why: str) -> tuple[str, Failure]:
    return named[0], Failure(named[0], why)


def _try_case(work: Callable[[Case], Record], named: tuple[str, Case]) -> tuple[str, Record | Failure]:
    name, case = named
    try:
        return name, work(case)
    except Exception as error:  # whatever it is, it is this case's failure and no other's
        return name, Failure(name, f"{type(error).__name__}: {error}")


@dataclass(frozen=True)
class Records(Generic[Record]):
    """A folder of records, a file each."""

    folder: Path  # folder, which several machines may share
    kind: type[Record]  # class of the records
    made_by: str = ""  # fingerprint of the code that makes them; records of other code do not count

    def read(self, name: str, inputs: str = "") -> Record | None:
        """Return the record of a case; None where there is none, or one of other inputs or other code."""
        with suppress(OSError, ValueError, KeyError, TypeError):
            written = json.loads(self._file(name).read_bytes())
            if written["made_by"] == self.made_by and written["inputs"] == inputs:
                record: Record = from_plain(self.kind, written["record"])
                return record
        return None

    def keep(self, name: str, record: Record, inputs: str = "") -> None:
        """Write a record, or write it anew.

        Raises:
            ResultsNotWritable: the folder is not writable.
        """
        whole = {"made_by": self.made_by, "inputs": inputs, "record": to_plain(record)}
        write_whole(self._file(name), json.dumps(plain_json(whole)) + "\n")

    def missing(self, names: Sequence[str]) -> list[str]:
        """Return the names without a record that counts."""
        return [name for name in names if self.read(name) is None]

    def every(self) -> dict[str, Record]:
        """Return all records that count, by name, shorter names first."""
        names = sorted((path.stem for path in self.folder.glob("*.json")), key=lambda name: (len(name), name))
        return {name: record for name in names if (record := self.read(name)) is not None}

    @property
    def others(self) -> int:
        """Number of records that do not count."""
        return len(list(self.folder.glob("*.json"))) - len(self.every())

    def _file(self, name: str) -> Path:
        return self.folder / f"{name}.json"


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
    write_whole(path, "".join(json.dumps(plain_json(to_plain(record))) + "\n" for record in records))


def read_lines(path: Path, kind: type[Record], name_of: Callable[[Record], str]) -> tuple[Record, ...]:
    """Read what `write_lines` wrote, whichever code made it.

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


def code_of(*roots: Path, libraries: Mapping[str, str] | None = None) -> str:
    """Return a fingerprint of all code and tables in some files and folders, and of the versions of libraries."""
    files = {
        file for root in roots for file in ([root] if root.is_file() else [*root.rglob("*.py"), *root.rglob("*.toml")])
    }
    return fingerprint_of(
        {f"{file.parent.name}/{file.name}": sha256_of(file) for file in sorted(files)}, libraries or {}
    )
