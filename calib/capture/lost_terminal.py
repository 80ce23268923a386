"""How a command ends that was interrupted, or whose terminal, or the program it wrote to, is gone."""

import os
import sys

INTERRUPTED = 130
"""The exit code after Ctrl-C, 128 + SIGINT as shells have it; what typer makes of it too."""


def let_go_of_a_lost_terminal() -> None:
    """Python ends with 120, whatever happened, where it cannot write what it still holds for a lost terminal."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
