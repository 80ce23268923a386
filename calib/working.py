"""A session under work on the command line: locked, with a progress bar, and its outcome told at the end."""

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from calib.options import Options, Tell
from calib.pipeline import Pipeline, open_session
from calib.summary import calibration_lines, structure_lines
from session import SESSION_FILE, session_lock

if TYPE_CHECKING:
    from diagnosis.result import SuppositionResult


@contextmanager
def working(folder: Path, quiet: bool, options: Options | None = None) -> Iterator[Pipeline]:
    """A locked session and its pipeline, with a progress bar unless quiet.

    Args:
        folder: of the session, or its `session.toml`.
        quiet: no progress.
        options: effort, threads, methods; who is told of the progress is replaced.
    """
    session = open_session(folder.parent if folder.name == SESSION_FILE else folder)
    with session_lock(session.folder), progress_bar(quiet) as tell:
        yield Pipeline(session, (options or Options()).telling(tell))


@contextmanager
def progress_bar(quiet: bool) -> Iterator[Tell]:
    """What is going on, the share done and an estimate of the time left, on a terminal only."""
    columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    console = Console(stderr=True)
    disabled = quiet or not console.is_terminal
    left = (TextColumn("left:"), TimeRemainingColumn())
    with Progress(*columns, *left, console=console, transient=True, disable=disabled) as bar:
        yield Teller(bar)


class Teller:
    """Receives progress; a share that is unknown, or falls, begins a stage with its own estimate of the time left.

    Args:
        bar: without tasks; its elapsed time is that of all stages.
    """

    def __init__(self, bar: Progress) -> None:
        self._bar, self._share = bar, 0.0
        self._task = bar.add_task("reading", total=None)
        self._began = bar.tasks[0].start_time

    def __call__(self, message: str, share: float | None) -> None:
        """Shows what is going on and the share done, None when unknown."""
        if share is None or share < self._share or self._bar.tasks[0].total is None:
            self._bar.remove_task(self._task)
            self._task = self._bar.add_task(message, total=None if share is None else 1.0)
            self._bar.tasks[0].start_time = self._began
        self._share = share or 0.0
        self._bar.update(self._task, description=message, completed=self._share)


def tell_outcome(pipeline: Pipeline, result: Path, as_json: bool) -> None:
    """The calibration, or the structure alone, on standard output; the path of the main result comes last."""
    if pipeline.only_dry:
        _tell(pipeline, result, as_json, "structure", result, structure_lines(pipeline.structure))
    else:
        _tell(
            pipeline, result, as_json, "calibration", pipeline.fits.file, calibration_lines(pipeline.the_fit().result())
        )


def tell_diagnosis(pipeline: Pipeline, result: Path, as_json: bool) -> None:
    """Three sentences and a table on standard output; the path of the result comes last."""
    from calib.diagnosis_summary import diagnosis_lines

    lines = diagnosis_lines(pipeline.diagnoses().read())
    _tell(pipeline, result, as_json, "diagnosis", result, lines)


def tell_supposition(pipeline: Pipeline, found: "SuppositionResult", as_json: bool) -> None:
    """A table on standard output; the path of the result comes last."""
    from calib.diagnosis_summary import supposition_lines
    from diagnosis.result import SUPPOSITION

    result = pipeline.session.results / SUPPOSITION.name
    _tell(pipeline, result, as_json, "supposition", result, supposition_lines(found))


def _tell(pipeline: Pipeline, result: Path, as_json: bool, what: str, file: Path, lines: Sequence[str]) -> None:
    """What came out, in lines or as JSON: the content of a file, and what was made."""
    if as_json:
        made = {"result": str(result), "made": list(map(str, pipeline.made)), "notes": list(pipeline.notes)}
        print(json.dumps(made | {what: json.loads(file.read_text())}, indent=1))
        return
    for line in (*pipeline.said, *pipeline.notes, *lines):
        print(line)
    print(result)
