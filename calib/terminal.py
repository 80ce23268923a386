"""The terminal: arguments that several commands share, and the lines they print.

`print_result` prints the output of a command when it is done: a few lines, all of it with -v, or JSON. Each command
imports what it works with itself, so that one that only prints its help, or drives the motor, waits for none of it.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from typer.core import TyperArgument, TyperCommand, TyperOption

if TYPE_CHECKING:
    from calib.results.result import Export, Result

EffortOption = Literal["quick", "full"]
LastStep = Literal["fit", "posterior", "diagnosis"]
ObjectiveOption = Literal["likelihood", "published"]
TrackerOption = Literal["hybrid", "spots", "csrt"]
FORMS = ("swimcal", "deeplabcut", "movement", "fishsim")
"""Forms of tracks, for help; what is given is compared with `tracking.formats.FORMATS`."""

_IN_WORDS = {
    "<int range>": "<number>",
    "<float range>": "<number>",
    "<int>": "<number>",
    "<float>": "<number>",
    "<str>": "<text>",
    "<list[Path]>": "<path> …",
}
"""Kinds of values as help tells them."""

SessionFolder = Annotated[Path, typer.Argument(metavar="SESSION", help="a session folder, with its session.toml")]
SessionFolders = Annotated[list[Path], typer.Argument(metavar="SESSION", help="one or more session folders")]
Effort = Annotated[
    EffortOption | None,
    typer.Option(help="how hard to search; default: that of the current results, else full", show_default=False),
]
PolicyEffort = Annotated[EffortOption, typer.Option(help="how hard to search, and on how many targets it is scored")]
Rename = Annotated[
    str, typer.Option(help="markers that the file names otherwise, its name first, comma-separated: snout=nose,…")
]
Workers = Annotated[int, typer.Option(min=0, help="threads; 0: all cores, or SWIMCAL_WORKERS")]
Scheduler = Annotated[str | None, typer.Option(help="address of a dask scheduler, whose workers do it; default: here")]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="every number and every flag, not the summary alone")]
AsJson = Annotated[bool, typer.Option("--json", help="print the outcome as JSON on standard output")]


class Command(TyperCommand):
    """A command whose help says of what kind a value is in words, not in terms of Python."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        for param in self.params:
            if isinstance(param, TyperOption | TyperArgument):
                kind = param.display_type(typer.Context(self))
                told = _IN_WORDS.get(kind, kind)
                told = told.removesuffix(" …") if isinstance(param, TyperArgument) else told  # its name says "…" itself
                vars(param)["display_type"] = lambda *_, told=told, **__: told


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
        lines = [*details, *(line for line in lines if line.startswith("Verdict of ") and line not in details)]
    return [*notes, *lines, str(main or result.file)]


def print_export(made: Export, as_json: bool = False) -> None:
    """Print what was written: what it is, then the files.

    Sessions that failed are named on standard error; then the exit code is 2.
    """
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


def _sort(notes: Iterable[str]) -> list[str]:
    """Sort notes so that warnings come first."""
    return sorted(notes, key=lambda note: not note.startswith("!"))


def renaming(text: str) -> dict[str, str]:
    """Parse the names of ``snout=nose,tip=caudal_fin``; an error of the command line for other text."""
    pairs = [part.split("=") for part in text.split(",") if part.strip()]
    names = {pair[0].strip(): pair[-1].strip() for pair in pairs}
    if not all(len(pair) == 2 and all(map(str.strip, pair)) for pair in pairs) or len(names) < len(pairs):
        raise typer.BadParameter(f"found {text!r}, expected theirs=ours such as snout=nose", param_hint="--rename")
    if len(set(names.values())) < len(names):
        raise typer.BadParameter(f"found {text!r}, expected each of our names once", param_hint="--rename")
    return names
