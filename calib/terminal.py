"""What a command prints when it is done: a few lines, all of it with -v, or JSON."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from calib.results.result import Export, Result


def print_result(result: Result, as_json: bool, verbose: bool, main: Path | None = None) -> None:
    """The outcome on standard output: JSON, numbers and verdict (`verbose`) or the summary; the path of `main` last."""
    path, notes = main or result.file, sorted(result.notes, key=lambda note: not note.startswith("!"))
    if as_json:
        made: dict[str, object] = {"result": str(path), "made": list(map(str, result.made)), "notes": notes}
        made["summary"] = result.summary().splitlines()
        print(json.dumps(made | {result.key: json.loads(result.file.with_suffix(".json").read_bytes())}, indent=1))
        return
    if len(notes) > 1 and not verbose:
        notes = [f"{notes[0]} ({len(notes) - 1} more notes: -v)"]
    lines = result.summary().splitlines()
    if verbose:
        details = result.details()
        lines = [*details, *(line for line in lines if line.startswith("Verdict: ") and line not in details)]
    for line in (*notes, *lines, path):
        print(line)


def print_export(made: Export, as_json: bool = False) -> None:
    """What was written: what it is, then the files; on standard error which sessions failed, with exit code 2."""
    if as_json:
        files = list(map(str, made.files))
        print(json.dumps({"files": files, "notes": made.notes, "failures": dict(made.failures)}, indent=1))
    else:
        for line in (*made.notes, *made.files):
            print(line)
        for name, why in made.failures.items():
            print(f"calib: {name} failed: {why}", file=sys.stderr)
    if made.failures:
        raise typer.Exit(2)
