"""The command `calib`: a door in front of the command line, whose imports take a second that Ctrl-C may fall into."""

import sys


def main() -> None:
    """Entry point: Ctrl-C ends with one line and exit code 130 from the first import on."""
    try:
        from calib.cli import main as command_line
    except KeyboardInterrupt:
        print("\ncalib: stopped before anything was begun.", file=sys.stderr)
        sys.exit(130)
    command_line()
