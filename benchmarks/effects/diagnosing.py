"""Runs of a program over the sessions of a suite: with all it knows, and once more without the effect that is there.

The one place where the benchmark meets the programs that it scores: each writes a session's `diagnosis.json`.
"""

import shlex
import shutil
import subprocess
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from benchmarks.cases import Failure, Run, run_cases
from benchmarks.effects.folder import DIAGNOSIS, SECONDS, SuiteFolder
from calib.options import Options
from calib.pipeline import Pipeline, open_session
from swimcal.results import write_whole

Program = Callable[[Path, frozenset[str]], None]
"""Function that diagnoses a session's folder, given the names that its catalogue is to lack."""


class ProgramFailed(RuntimeError):
    """Failure of a program that ended with an error; its last words are the message."""


def diagnose(session: Path, without: frozenset[str]) -> None:
    """Diagnose as `calib diagnose --effort quick` does, on one core."""
    Pipeline(open_session(session), Options("quick", workers=1)).diagnosis(without)


def program_of(command: str) -> Program:
    """Return the program that a command line names; the toolkit's own for an empty one.

    A session's folder is appended, and `--exclude EFFECT[,EFFECT]`, as `calib diagnose` takes them.
    """
    return partial(_run_command, tuple(shlex.split(command))) if command else diagnose


def _run_command(words: tuple[str, ...], session: Path, without: frozenset[str]) -> None:
    lacking = ("--exclude", ",".join(sorted(without))) if without else ()
    ended = subprocess.run([*words, str(session), *lacking], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    if ended.returncode:
        lines = ended.stderr.decode(errors="replace").strip().splitlines()
        raise ProgramFailed(f"ended with status {ended.returncode}: {lines[-1] if lines else 'no message'}")


Piece = tuple[Path, frozenset[str]]
"""Folder of a session, and the effects that the catalogue is to lack."""


def diagnose_suite(suite: SuiteFolder, program: Program, run: Run) -> tuple[Failure, ...]:
    """Diagnose the sessions that have no diagnosis yet; each is written into its session's folder.

    Args:
        suite: folder of a suite that was made.
        program: program that diagnoses; it can be pickled.
        run: way to work off the sessions.

    Returns:
        Sessions that gave no diagnosis; the next run tries them again.
    """
    return _diagnose_pieces(program, [(suite.sessions / name, frozenset()) for name in suite.names], run)


def diagnose_without(suite: SuiteFolder, program: Program, run: Run) -> tuple[Failure, ...]:
    """Diagnose each session with one effect once more, by a catalogue that lacks it, in a copy in `F/without`.

    This opens the answers, of sessions that are diagnosed; but the program gets only the name that its catalogue is to
    lack.

    Args:
        suite: folder of a suite that was diagnosed.
        program: program that diagnoses; it can be pickled.
        run: way to work off the sessions.

    Returns:
        Sessions that gave no diagnosis; the next run tries them again.

    Raises:
        InputError: a session is not diagnosed yet.
    """
    suite.check_diagnosed()  # From here on the name of the true effect is in a folder.
    pieces = [(suite.without / name, frozenset(answer.effects)) for name, answer in suite.singles.items()]
    for copy, _ in pieces:
        _copy(suite.sessions / copy.name, copy)
    return _diagnose_pieces(program, pieces, run)


def _copy(session: Path, folder: Path) -> None:
    """Copy what was already fitted in a session, which does not depend on the catalogue; but not its diagnosis."""
    if not folder.exists():
        part = folder.with_name(f".{folder.name}")
        shutil.rmtree(part, ignore_errors=True)
        shutil.copytree(session, part, ignore=shutil.ignore_patterns("diagnosis.*", "*.lock"))
        part.rename(folder)


def _diagnose_pieces(program: Program, pieces: list[Piece], run: Run) -> tuple[Failure, ...]:
    todo = {piece[0].name: piece for piece in pieces if not (piece[0] / DIAGNOSIS).exists()}
    return run_cases(partial(diagnose_one, program), todo, run)


def diagnose_one(program: Program, piece: Piece) -> None:
    """Diagnose one session, and note how long that took.

    Raises:
        FileNotFoundError: the program wrote no diagnosis.
    """
    session, without = piece
    began = time.perf_counter()
    program(session, without)
    if not (session / DIAGNOSIS).exists():
        raise FileNotFoundError(f"ended without a {DIAGNOSIS}")
    write_whole(session / SECONDS, f"{time.perf_counter() - began:.1f}\n")
