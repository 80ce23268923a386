"""The one place where the benchmark meets the programs that it scores: each writes a session's `diagnosis.json`."""

import shlex
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from calib.options import Options
from calib.pipeline import Pipeline, open_session
from diagnosis import Discrepancy

Program = Callable[[Path, Discrepancy, frozenset[str]], None]
"""Diagnoses a session's folder, given the discrepancy and the names that its catalogue is to lack."""


class ProgramFailed(RuntimeError):
    """A program ended with an error; its last words are the message."""


def diagnose(session: Path, discrepancy: Discrepancy, without: frozenset[str]) -> None:
    """Diagnoses as `calib diagnose --effort quick` does, on one core."""
    Pipeline(open_session(session), Options("quick", workers=1)).diagnosis(without, discrepancy)


@dataclass(frozen=True)
class CommandLine:
    """Any program that takes a session's folder, and `--without EFFECT[,EFFECT]`, as `calib diagnose` does.

    It may find the discrepancy beside the sessions; it is not told.

    Attributes:
        words: of the command, to which these are appended.
    """

    words: tuple[str, ...]

    def __call__(self, session: Path, _discrepancy: Discrepancy, without: frozenset[str]) -> None:
        """Runs it.

        Raises:
            ProgramFailed: it ended with another status than 0.
        """
        lacking = ("--without", ",".join(sorted(without))) if without else ()
        ended = subprocess.run([*self.words, str(session), *lacking], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        if ended.returncode:
            said = ended.stderr.decode(errors="replace").strip().splitlines()
            raise ProgramFailed(f"ended with status {ended.returncode}: {said[-1] if said else 'no word of why'}")


def program_of(command: str) -> Program:
    """The program that a command line names; the toolkit's own for an empty one."""
    return CommandLine(tuple(shlex.split(command))) if command else diagnose
