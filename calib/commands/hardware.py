"""The command that works the motor: `capture`, which is a program of its own (`python -m calib.capture`)."""

import typer

FREE_ARGUMENTS = {"allow_extra_args": True, "ignore_unknown_options": True}
"""What follows is read by the program itself, which runs on a robot without any of this."""


def capture(context: typer.Context) -> None:
    """Drives and logs the motor: scan, run, emulate (`calib capture --help`)."""
    from calib.capture import main

    raise typer.Exit(main(context.args))
