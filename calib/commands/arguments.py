"""Arguments that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

from calib.options import EffortName

SessionFolder = Annotated[Path, typer.Argument(metavar="SESSION", help="a session folder, with its session.toml")]
Effort = Annotated[EffortName, typer.Option(help="how hard to search; recorded in the results")]
Workers = Annotated[int, typer.Option(min=0, help="threads; 0: all cores, or as SWIMCAL_WORKERS says")]
AsJson = Annotated[bool, typer.Option("--json", help="print the outcome as JSON on standard output")]
