"""The command line. What has not changed is not made again; commands that show or export use existing results."""

import sys
from collections.abc import Callable
from typing import Annotated

import typer

from calib.capture.bus import INTERRUPTED, let_go_of_a_lost_terminal
from calib.commands import (
    SeveralFiles,
    aquarium,
    board,
    convert,
    diagnose,
    doctor,
    edit,
    evaluate,
    fit,
    lens,
    mjcf,
    new,
    play,
    posterior,
    report,
    robot,
    run,
    scale,
    track,
    train,
    view,
)
from calib.terminal import Command

app = typer.Typer(
    rich_markup_mode=None,  # rich takes longer to load than everything else that help needs
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="From videos or tracks of a tendon-driven robot fish to a calibrated MuJoCo twin and a report.",
)
camera = typer.Typer(rich_markup_mode=None, no_args_is_help=True, help="The lens and the scale, from a printed board.")
policy = typer.Typer(
    rich_markup_mode=None, no_args_is_help=True, help="Policies that steer the twin: trained, scored and shown."
)

COMMANDS: dict[Callable[..., None], tuple[str, str]] = {
    run: ("run every stage the session has data for", "calib run pool-1 pool-2 --jobs 2"),
    new: ("make a session from your videos or tracks", "calib new pool --videos f0_50.mp4 f0_75.mp4 f1_25.mp4"),
    track: ("track the markers in the videos", "calib track pool --method spots"),
    edit: ("correct the tracks", """calib edit pool f1_00 '{"op": "undo", "line": 2}'"""),
    fit: ("fit the structure and the coefficients", "calib fit pool --effort quick"),
    posterior: ("sample the posterior of the coefficients", "calib posterior pool"),
    diagnose: ("locate the gap, rank its likely causes", "calib diagnose pool --exclude tendon_slack"),
    report: ("write the HTML report, or several and an index", "calib report pool-1 pool-2 --index all.html"),
    view: ("write the rerun recording", "calib view pool --open"),
    convert: (
        "convert tracks of DeepLabCut and others",
        "calib convert f1_00.csv --out f1_00.nc --to movement",
    ),
    mjcf: ("write the calibrated or the nominal MJCF", "calib mjcf pool --out fish.xml"),
    robot: ("draw a robot's description, with its numbers", "calib robot my_fish.toml --out my_fish.png"),
    doctor: ("check installation, session and motor", "calib doctor pool --motor"),
    board: ("draw the board to print", "calib camera board --out board.pdf"),
    lens: ("calibrate the lens from a video of the board", "calib camera lens board.mp4 --out camera.toml"),
    scale: (
        "measure the scale from a picture of the board",
        "calib camera scale board_on_water.png --camera camera.toml",
    ),
    aquarium: ("film many swimmers at once", "calib aquarium pool --swimmers 200 --out pool.rrd"),
    train: ("train a policy on the twin and score it", "calib policy train pool --task circle"),
    evaluate: ("score a policy next to the paper's", "calib policy evaluate pool --task circle"),
    play: ("film one episode of a policy", "calib policy play pool --target=-2,0.5 --out reach.mp4"),
}
"""The commands, each with a summary and an example for its help."""
GROUPS = dict.fromkeys((board, lens, scale), camera) | dict.fromkeys((train, evaluate, play), policy)

app.add_typer(camera, name="camera", short_help="calibrate the lens, measure the scale")
for command, (made, example) in COMMANDS.items():
    kind = SeveralFiles if command is new else Command
    GROUPS.get(command, app).command(cls=kind, short_help=made, epilog=f"Example: {example}")(command)
app.add_typer(policy, name="policy", short_help="train and score policies on the twin")


@app.command(
    short_help="drive and log the motor",
    context_settings={"allow_extra_args": True, "ignore_unknown_options": True},
    add_help_option=False,  # the capture program reads its own options: it also runs on a robot without typer
)
def capture(context: typer.Context) -> None:
    """Drive and log the motor: scan, run, emulate (`calib capture --help`)."""
    from calib.capture.functions import main as drive

    raise typer.Exit(drive(context.args))


def main() -> None:
    """Run the command line: errors of ours become one clear message and exit code 2, Ctrl-C exit code 130."""
    try:
        app(standalone_mode=True)
    except SystemExit as end:
        if end.code == INTERRUPTED:
            print("\ncalib: stopped. What was finished is kept; the same command goes on from there.", file=sys.stderr)
        raise
    except Exception as error:
        from swimcal.errors import SwimcalError  # takes longer to load than all help

        if not isinstance(error, SwimcalError):
            raise
        print(f"calib: {error}", file=sys.stderr)
        sys.exit(error.exit_code)
    finally:
        let_go_of_a_lost_terminal()


@app.callback(invoke_without_command=True)
def version(
    show: Annotated[bool, typer.Option("--version", help="print the versions and exit")] = False,
) -> None:
    """Handle the options before a command."""
    if show:
        from swimcal.results import program_version
        from swimcal.runs import ENGINE

        print(f"{program_version()}, MuJoCo {ENGINE}")
        raise typer.Exit
