"""The command line. What has not changed is not made again; what shows or exports uses existing results."""

import sys
from collections.abc import Callable
from typing import Annotated

import typer

from calib.capture.host import INTERRUPTED, let_go_of_a_lost_terminal
from calib.commands import benchmarks, cameras, policies, results, videos
from session import SwimcalError

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="From videos or tracks of a tendon-driven robot fish to a calibrated MuJoCo twin and a report.",
)
camera = typer.Typer(no_args_is_help=True, help="The lens and the scale, from a printed board.")

EXAMPLES: dict[Callable[..., None], str] = {
    results.run: "calib run pool-1 pool-2 --jobs 2",
    results.new: "calib new pool --videos f0_75.mp4 f1_25.mp4",
    videos.track: "calib track pool --method spots",
    videos.edit: """calib edit pool f1_00 '{"op": "undo", "line": 2}'""",
    results.fit: "calib fit pool --effort quick",
    results.posterior: "calib posterior pool",
    results.diagnose: "calib diagnose pool --exclude tendon_slack",
    results.report: "calib report pool-1 pool-2 --index all.html",
    videos.view: "calib view pool --open",
    videos.convert: "calib convert f1_00.csv --out f1_00.nc --to movement",
    results.mjcf: "calib mjcf pool --out fish.xml",
    results.doctor: "calib doctor pool --motor",
    cameras.board: "calib camera board --out board.pdf",
    cameras.lens: "calib camera lens board.mp4 --out camera.toml",
    cameras.scale: "calib camera scale board_on_water.png --camera camera.toml",
    policies.aquarium: "calib aquarium pool --swimmers 200 --out pool.rrd",
}
"""Of each command, for its help."""
OF_CAMERA = (cameras.board, cameras.lens, cameras.scale)

app.add_typer(camera, name="camera")
for command, example in EXAMPLES.items():
    kind = results.SeveralFiles if command is results.new else None
    (camera if command in OF_CAMERA else app).command(cls=kind, epilog=f"Example: {example}")(command)
benchmarks.benchmark.command()(policies.gym)
app.add_typer(benchmarks.benchmark, name="benchmark")
app.add_typer(policies.policy, name="policy")


@app.command(
    context_settings={"allow_extra_args": True, "ignore_unknown_options": True},
    add_help_option=False,  # what follows is read by the program itself, which runs on a robot without any of this
)
def capture(context: typer.Context) -> None:
    """Drives and logs the motor: scan, run, emulate (`calib capture --help`)."""
    from calib.capture import main as drive

    raise typer.Exit(drive(context.args))


def main() -> None:
    """Entry point: errors of ours become one clear message and exit code 2, Ctrl-C exit code 130."""
    try:
        app(standalone_mode=True)
    except SwimcalError as error:
        print(f"calib: {error}", file=sys.stderr)
        sys.exit(error.exit_code)
    except SystemExit as end:
        if end.code == INTERRUPTED:
            print("\ncalib: stopped. What was finished is kept; the same command goes on from there.", file=sys.stderr)
        raise
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


if __name__ == "__main__":
    main()
