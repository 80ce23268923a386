"""`python -m benchmarks`, from the root of a checkout: measure what is claimed of speed and accuracy."""

import sys

import typer

from benchmarks.command import COMMANDS
from swimcal.errors import SwimcalError

app = typer.Typer(
    rich_markup_mode=None,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="Measure what is claimed of speed and accuracy.",
)
for command, example in COMMANDS.items():
    app.command(epilog=f"Example: python -m benchmarks {example}")(command)


def main() -> None:
    """Run the command; an error of the toolkit becomes one message and its exit code."""
    try:
        app(prog_name="python -m benchmarks")
    except SwimcalError as error:
        print(f"benchmarks: {error}", file=sys.stderr)
        sys.exit(error.exit_code)


if __name__ == "__main__":
    main()
