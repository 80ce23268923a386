"""The arguments that several commands share.

Each command imports what it works with itself, so that one that only prints its help, or drives the motor, waits for
none of it.
"""

from pathlib import Path
from typing import Annotated, Literal

import typer

EffortOption = Literal["quick", "full"]
LastStep = Literal["fit", "posterior", "diagnosis"]
ObjectiveOption = Literal["likelihood", "published"]
TrackerOption = Literal["hybrid", "spots", "csrt"]
FORMS = ("swimcal", "deeplabcut", "movement", "fishsim")
"""Forms of tracks, for help; what is given is compared with `tracking.records.formats.FORMATS`."""

SessionFolder = Annotated[Path, typer.Argument(metavar="SESSION", help="a session folder, with its session.toml")]
SessionFolders = Annotated[list[Path], typer.Argument(metavar="SESSION...", help="one or more session folders")]
Effort = Annotated[
    EffortOption | None,
    typer.Option(help="how hard to search; default: that of the current results, else full", show_default=False),
]
PolicyEffort = Annotated[EffortOption, typer.Option(help="how hard to search, and on how many targets it is scored")]
Rename = Annotated[
    str, typer.Option(help="names of the file, and which markers they are, comma-separated: snout=nose,…")
]
Workers = Annotated[int, typer.Option(min=0, help="threads; 0: all cores, or SWIMCAL_WORKERS")]
Scheduler = Annotated[str | None, typer.Option(help="address of a dask scheduler, whose workers do it; default: here")]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="every number and every flag, not the summary alone")]
AsJson = Annotated[bool, typer.Option("--json", help="print the outcome as JSON on standard output")]


def renaming(text: str) -> dict[str, str]:
    """Parse the names of ``snout=nose,tip=caudal_fin``; an error of the command line for other text."""
    pairs = [part.split("=") for part in text.split(",") if part.strip()]
    names = {pair[0].strip(): pair[-1].strip() for pair in pairs}
    if not all(len(pair) == 2 and all(map(str.strip, pair)) for pair in pairs) or len(names) < len(pairs):
        raise typer.BadParameter(f"found {text!r}, expected theirs=ours such as snout=nose", param_hint="--rename")
    if len(set(names.values())) < len(names):
        raise typer.BadParameter(f"found {text!r}, expected each of our names once", param_hint="--rename")
    return names
