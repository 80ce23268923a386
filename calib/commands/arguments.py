"""Arguments that several commands share.

What a command works with it imports itself: one that only prints its help, or drives the motor, waits for none of it.
"""

from pathlib import Path
from typing import Annotated, Literal

import typer

EffortOption = Literal["quick", "full"]
LastStep = Literal["fit", "posterior", "diagnosis"]
ObjectiveOption = Literal["likelihood", "published"]
TrackerOption = Literal["hybrid", "spots", "csrt"]
FORMS = ("swimcal", "deeplabcut", "movement", "fishsim")
"""Of tracks, for help; what is given is held against `tracking.records.formats.FORMATS`."""

SessionFolder = Annotated[Path, typer.Argument(metavar="SESSION", help="a session folder, with its session.toml")]
SessionFolders = Annotated[list[Path], typer.Argument(metavar="SESSION...", help="one or more session folders")]
Effort = Annotated[
    EffortOption | None,
    typer.Option(help="how hard to search; default: as the results that stand, else full", show_default=False),
]
PolicyEffort = Annotated[EffortOption, typer.Option(help="how hard to search, and on how many targets it is scored")]
Workers = Annotated[int, typer.Option(min=0, help="threads; 0: all cores, or SWIMCAL_WORKERS")]
Scheduler = Annotated[str | None, typer.Option(help="address of a dask scheduler, whose workers do it; default: here")]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="every number and every flag, not the summary alone")]
AsJson = Annotated[bool, typer.Option("--json", help="print the outcome as JSON on standard output")]
