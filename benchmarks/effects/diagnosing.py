"""Runs a program over the sessions of a suite: with all it knows, and once more without the effect that is there."""

import shutil
import time
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

from benchmarks.effects.each_session import each_session
from benchmarks.effects.folder import DIAGNOSIS, SECONDS, Failure, SuiteFolder, Tell
from benchmarks.effects.program import Program
from diagnosis import Discrepancy
from session import write_whole

Piece = tuple[str, frozenset[str]]
"""A session's name, and the effects that the catalogue is to lack."""


def diagnose_suite(
    suite: SuiteFolder,
    program: Program,
    workers: int = 0,
    scheduler: str | None = None,
    tell: Tell | None = None,
) -> tuple[Failure, ...]:
    """Diagnoses the sessions that have no diagnosis yet; each is written into its session's folder.

    Args:
        suite: that was made.
        program: that diagnoses; it can be pickled.
        workers: sessions at a time; 0 for one on each core.
        scheduler: address of a dask scheduler whose workers do it; they need to see the same folder.
        tell: of the progress.

    Returns:
        Sessions that gave no diagnosis; the next run tries them again.

    Raises:
        InputError: no scheduler answers.
    """
    pieces = [(name, frozenset[str]()) for name in suite.names]
    return _diagnosed(suite, suite.sessions, program, pieces, (workers, scheduler, tell))


def diagnose_without(
    suite: SuiteFolder,
    program: Program,
    workers: int = 0,
    scheduler: str | None = None,
    tell: Tell | None = None,
) -> tuple[Failure, ...]:
    """Diagnoses each session with one effect once more, by a catalogue that lacks it, in a copy in `F/without`.

    This opens the answers, of sessions that are diagnosed; but the program is told one name only, and that this is not
    to be found.

    Args, Returns: as of `diagnose_suite`.

    Raises:
        InputError: as of `diagnose_suite`, or a session is not diagnosed yet.
    """
    suite.check_diagnosed()  # the name of what is there stands in a folder from now on
    pieces = [(name, frozenset({effect})) for name, effect in lacking(suite).items()]
    for name, _ in pieces:
        _copy(suite.sessions / name, suite.without / name)
    return _diagnosed(suite, suite.without, program, pieces, (workers, scheduler, tell))


def lacking(suite: SuiteFolder) -> Mapping[str, str]:
    """The effect of each session that holds a single one of the catalogue."""
    return {answer.session: answer.effects[0] for answer in suite.true() if answer.kind == "single"}


def _copy(session: Path, folder: Path) -> None:
    """With what was already fitted in it, which does not depend on the catalogue; but not with its diagnosis."""
    if not folder.exists():
        part = folder.with_name(f".{folder.name}")
        shutil.rmtree(part, ignore_errors=True)
        shutil.copytree(session, part, ignore=shutil.ignore_patterns("diagnosis.*", "*.lock"))
        part.rename(folder)


def _diagnosed(
    suite: SuiteFolder,
    folder: Path,
    program: Program,
    pieces: Sequence[Piece],
    how: tuple[int, str | None, Tell | None],
) -> tuple[Failure, ...]:
    workers, scheduler, tell = how
    todo = [piece for piece in pieces if not (folder / piece[0] / DIAGNOSIS).exists()]
    return each_session(partial(attempt, program, folder, suite.discrepancy), todo, workers, scheduler, tell)


def attempt(program: Program, folder: Path, discrepancy: Path, piece: Piece) -> Failure | None:
    """Diagnoses one session of a folder; what fails is told."""
    name, without = piece
    began = time.perf_counter()
    try:
        program(folder / name, Discrepancy.load(discrepancy), without)
    except Exception as error:  # whatever it is, it is this session's failure and no other's
        return Failure(name, f"{type(error).__name__}: {error}")
    if not (folder / name / DIAGNOSIS).exists():
        return Failure(name, f"ended without a {DIAGNOSIS}")
    write_whole(folder / name / SECONDS, f"{time.perf_counter() - began:.1f}\n")
    return None
