"""The command `calib`: a door in front of the command line, whose imports take a second that Ctrl-C may fall into."""

import sys


def main() -> None:
    """Entry point: Ctrl-C ends with one line and exit code 130 from the first import on."""
    from calib.shadowing import check_shadowing

    try:
        check_shadowing()
        from calib.cli import main as command_line
    except KeyboardInterrupt:
        print("\ncalib: stopped before anything was begun.", file=sys.stderr)
        sys.exit(130)
    except ImportError as error:
        if not str(error).startswith("calib cannot be loaded"):
            raise
        print(f"calib: {error}", file=sys.stderr)
        sys.exit(2)
    command_line()
