"""The output of a command when it is done: a few lines, all of it with -v, or JSON."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from calib.kept_output import standing_output

if TYPE_CHECKING:
    from calib.results.result import Export, Result


def print_result(result: Result, as_json: bool, verbose: bool, main: Path | None = None) -> None:
    """Print the outcome: JSON, numbers and verdict (`verbose`) or the summary; the path of `main` last.

    Args:
        result: the result.
        as_json: print JSON.
        verbose: print every number and every flag.
        main: the file to name last; default: that of the result.
    """
    if as_json:
        of_it = {"result": str(main or result.file), "made": list(map(str, result.made))}
        told = {"notes": _sort(result.notes), "summary": result.summary().splitlines()}
        made: dict[str, Any] = of_it | told
        print(json.dumps(made | {result.key: json.loads(result.file.with_suffix(".json").read_bytes())}, indent=1))
        return
    for line in result_lines(result, verbose, main):
        print(line)


def result_lines(result: Result, verbose: bool, main: Path | None = None) -> list[str]:
    """Return the lines of a result: notes, numbers and verdict (`verbose`) or the summary, the path of `main` last."""
    notes = _sort(result.notes)
    if len(notes) > 1 and not verbose:
        notes = [f"{notes[0]} ({len(notes) - 1} more notes: -v)"]
    lines = result.summary().splitlines()
    if verbose:
        details = result.details()
        lines = [*details, *(line for line in lines if line.startswith("Verdict: ") and line not in details)]
    return [*notes, *lines, str(main or result.file)]


def print_again(command: str, session: Path, effort: str | None, verbose: bool = False) -> bool:
    """Print what a command says of the current results, where there is nothing to do; return whether it did.

    Args:
        command: name of the command.
        session: the session folder, or its `session.toml`.
        effort: as requested; None for that of the current results.
        verbose: print every number and every flag.
    """
    text = standing_output(command, session.parent if session.name == "session.toml" else session, effort, verbose)
    print(text or "", end="")
    return text is not None


def _sort(notes: Iterable[str]) -> list[str]:
    """Sort notes so that warnings come first."""
    return sorted(notes, key=lambda note: not note.startswith("!"))


def export_lines(notes: Iterable[str], files: Iterable[Path]) -> list[str]:
    """Return the lines of files that were written: what they are, then where they are."""
    return [*notes, *map(str, files)]


def print_export(made: Export, as_json: bool = False) -> None:
    """Print what was written: what it is, then the files.

    Sessions that failed are named on standard error; then the exit code is 2.
    """
    if as_json:
        files = list(map(str, made.files))
        print(json.dumps({"files": files, "notes": made.notes, "failures": dict(made.failures)}, indent=1))
    else:
        for line in export_lines(made.notes, made.files):
            print(line)
        for name, why in made.failures.items():
            print(f"calib: {name} failed: {why}", file=sys.stderr)
    if made.failures:
        raise typer.Exit(2)
