"""The command that makes a session folder: `new`."""

from pathlib import Path
from typing import Annotated

import typer


def new(
    session: Annotated[Path, typer.Argument(metavar="SESSION", help="the folder to make")],
    from_fishsim: Annotated[
        Path | None,
        typer.Option(help="a checkout of the authors' repository, or a folder of its marker CSVs"),
    ] = None,
    synthetic: Annotated[bool, typer.Option("--synthetic", help="a session made with the twin, truth known")] = False,
    fit: Annotated[str, typer.Option(help="trials to fit on, comma-separated; the others are held out")] = "",
    seed: Annotated[int, typer.Option(min=0, help="of a synthetic session")] = 0,
) -> None:
    """Makes a session folder."""
    from session import new_from_fishsim

    if (from_fishsim is None) == (not synthetic):
        raise typer.BadParameter("give either --from-fishsim DIR or --synthetic")
    if from_fishsim is not None:
        print(new_from_fishsim(session, from_fishsim, tuple(name.strip() for name in fit.split(",") if name.strip())))
        return
    from calib.working import progress_bar
    from synthetic import default_plan, make_session

    with progress_bar(quiet=False) as tell:
        tell("simulating the swims", None)
        made = make_session(session, default_plan(seed))
    print(made)
