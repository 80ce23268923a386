"""The command that makes a session folder: `new`."""

from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

_MANY = ("--videos", "--tracks")


class SeveralFiles(TyperCommand):
    """A command whose options of files take all files up to the next option, as the shell expands ``*.mp4``."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Gives each file an option of its own."""
        spread, option = [], ""
        for argument in args:
            if argument.startswith("-"):
                option = argument if argument in _MANY else ""
                spread += [] if option else [argument]
            else:
                spread += [option, argument] if option else [argument]
        return super().parse_args(ctx, spread)


def new(  # noqa: PLR0913
    session: Annotated[Path, typer.Argument(metavar="SESSION", help="the folder to make")],
    videos: Annotated[
        list[Path] | None, typer.Option(help="videos, one a trial; all that follow up to the next option")
    ] = None,
    tracks: Annotated[list[Path] | None, typer.Option(help="tracks in any form, one a trial; as --videos")] = None,
    robot: Annotated[Path | None, typer.Option(help="the robot's TOML; default: the published 0.57 m fish")] = None,
    fps: Annotated[float | None, typer.Option(help="frames a second of tracks without time")] = None,
    commands: Annotated[
        str, typer.Option(help="crank turns a second of each trial, comma-separated; default: as names like f1_25 tell")
    ] = "",
    from_fishsim: Annotated[
        Path | None,
        typer.Option(help="a checkout of the authors' repository, or a folder of its marker CSVs"),
    ] = None,
    synthetic: Annotated[bool, typer.Option("--synthetic", help="a session made with the twin, truth known")] = False,
    fit: Annotated[str, typer.Option(help="trials to fit on, comma-separated; the others are held out")] = "",
    seed: Annotated[int, typer.Option(min=0, help="of a synthetic session")] = 0,
) -> None:
    """Makes a session folder of your videos or tracks, and tells what is left to fill in."""
    from calib import interface
    from session.folder import SESSION_FILE

    own = bool(videos or tracks)
    if own + (from_fishsim is not None) + synthetic != 1:
        raise typer.BadParameter("give --videos and --tracks, or --from-fishsim DIR, or --synthetic")
    fitted = tuple(name.strip() for name in fit.split(",") if name.strip())
    if from_fishsim is not None:
        interface.new_public_session(session, from_fishsim, fitted)
    elif synthetic:
        interface.new_synthetic_session(session, seed)
    else:
        hz = _numbers(commands)
        interface.new_session(
            session, videos=videos or (), tracks=tracks or (), robot=robot, fps=fps, commands_hz=hz, fit=fitted
        )
    for line in (session / SESSION_FILE).read_text().splitlines():
        if line.startswith("# TODO"):
            print(f"to fill in: {line.removeprefix('# TODO ')}")
    print(session)


def _numbers(told: str) -> tuple[float, ...]:
    try:
        return tuple(float(number) for number in told.split(",") if number.strip())
    except ValueError as error:
        raise typer.BadParameter(
            f"found {told!r}, expected numbers such as 0.5,0.75", param_hint="--commands"
        ) from error
