"""The command `benchmark`: `speed`, and in a checkout also those that measure what is claimed of accuracy."""

import json
import sys
from importlib import import_module
from pathlib import Path
from typing import Annotated

import typer

import calib
from calib.commands.arguments import AsJson

CHECKOUT = Path(__file__).parents[2]
benchmark = typer.Typer(rich_markup_mode=None, no_args_is_help=True)


@benchmark.command(epilog="Example: calib benchmark speed --session pool")
def speed(
    session: Annotated[
        Path | None, typer.Option(help="also measure with the coefficients of this calibrated session")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Times real time on one core and on all, and a bare step without fluid; distance to an 8 times finer step."""
    outcome = calib.benchmark.speed(session)
    print(json.dumps(outcome.to_json(), indent=1) if as_json else calib.benchmark.speed_table(outcome))


def add_development_benchmarks() -> None:
    """Adds the commands of the folder ``benchmarks`` of a checkout; the help explains where there is none.

    It is found by its place, not by its name: an installed package of another project may be called ``benchmarks``.
    """
    about = "Measures what is claimed of speed and accuracy."
    if not ((CHECKOUT / "benchmarks" / "command.py").is_file() and (CHECKOUT / "pyproject.toml").is_file()):
        benchmark.info.help = f"{about} Tracking, posterior and effects: from a checkout of swimcal only."
        return
    benchmark.info.help = about
    if str(CHECKOUT) not in sys.path:
        sys.path.insert(0, str(CHECKOUT))
    for command, example in import_module("benchmarks.command").COMMANDS.items():
        benchmark.command(epilog=f"Example: calib benchmark {example}")(command)


add_development_benchmarks()
