"""The command line. What has not changed is not made again; what shows or exports uses existing results."""

import sys
from collections.abc import Callable
from typing import Annotated

import typer

from calib.capture.host import INTERRUPTED, let_go_of_a_lost_terminal
from calib.commands import cameras, policies, results, videos

app = typer.Typer(
    rich_markup_mode=None,  # which takes longer to load than all else that help needs
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="From videos or tracks of a tendon-driven robot fish to a calibrated MuJoCo twin and a report.",
)
camera = typer.Typer(rich_markup_mode=None, no_args_is_help=True, help="The lens and the scale, from a printed board.")

COMMANDS: dict[Callable[..., None], tuple[str, str]] = {
    results.run: ("all that the data allow, and the report", "calib run pool-1 pool-2 --jobs 2"),
    results.new: ("a session folder from your videos or tracks", "calib new pool --videos f0_75.mp4 f1_25.mp4"),
    videos.track: ("markers in the videos", "calib track pool --method spots"),
    videos.edit: ("a correction of tracks", """calib edit pool f1_00 '{"op": "undo", "line": 2}'"""),
    results.fit: ("structure, coefficients, forecasts", "calib fit pool --effort quick"),
    results.posterior: ("how sure the coefficients are", "calib posterior pool"),
    results.diagnose: ("where the gap is, which effect makes it", "calib diagnose pool --exclude tendon_slack"),
    results.report: ("the HTML report; of several an index and CSV", "calib report pool-1 pool-2 --index all.html"),
    videos.view: ("the rerun recording", "calib view pool --open"),
    videos.convert: (
        "tracks of DeepLabCut, movement and others",
        "calib convert f1_00.csv --out f1_00.nc --to movement",
    ),
    results.mjcf: ("the calibrated or the nominal MJCF", "calib mjcf pool --out fish.xml"),
    results.doctor: ("checks installation, session and motor", "calib doctor pool --motor"),
    cameras.board: ("the board to print", "calib camera board --out board.pdf"),
    cameras.lens: ("the lens, from a video of the board", "calib camera lens board.mp4 --out camera.toml"),
    cameras.scale: (
        "the scale, from a picture of the board",
        "calib camera scale board_on_water.png --camera camera.toml",
    ),
    policies.aquarium: ("many swimmers at once, filmed", "calib aquarium pool --swimmers 200 --out pool.rrd"),
}
"""Each with what it makes and an example, for help."""
OF_CAMERA = (cameras.board, cameras.lens, cameras.scale)

app.add_typer(camera, name="camera", short_help="the lens and the scale")
for command, (made, example) in COMMANDS.items():
    kind = results.SeveralFiles if command is results.new else None
    group = camera if command in OF_CAMERA else app
    group.command(cls=kind, short_help=made, epilog=f"Example: {example}")(command)
app.add_typer(policies.policy, name="policy", short_help="trains and scores policies on the twin")


@app.command(
    short_help="drives and logs the motor",
    context_settings={"allow_extra_args": True, "ignore_unknown_options": True},
    add_help_option=False,  # what follows is read by the program itself, which runs on a robot without any of this
)
def capture(context: typer.Context) -> None:
    """Drives and logs the motor: scan, run, emulate (`calib capture --help`)."""
    from calib.capture.command import main as drive

    raise typer.Exit(drive(context.args))


def main() -> None:
    """Entry point: errors of ours become one clear message and exit code 2, Ctrl-C exit code 130."""
    try:
        app(standalone_mode=True)
    except SystemExit as end:
        if end.code == INTERRUPTED:
            print("\ncalib: stopped. What was finished is kept; the same command goes on from there.", file=sys.stderr)
        raise
    except Exception as error:
        from session import SwimcalError  # takes longer to load than all help

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
    """Options before a command."""
    if show:
        from session.results import program_version
        from swimmer.engine import ENGINE

        print(f"{program_version()}, MuJoCo {ENGINE}")
        raise typer.Exit
